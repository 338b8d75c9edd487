"""workbench.py with an arm that reaches for goals: the same figures over ROS as in-process.

Evaluations come in the midst of episodes, and move the robot that is learned with. Halfway, in the midst of
an episode, the training over ROS ends with its simulator, and is gone on with in another one.
"""

import importlib.util
import json
import unittest
from pathlib import Path

from support.ros.programs import Place

from cartpole import workbench

ARM = "robot_envs/TwoLinkReachGoal-v0"
HAS_SB3 = importlib.util.find_spec("stable_baselines3") is not None


def figures(run: Path) -> list[str]:
    """What a training has logged, but for its speed and the clock."""
    with (run / "scalars.csv").open() as rows:
        return [",".join(row.split(",")[:3]) for row in rows if "SPS" not in row]


class WorkbenchGoals(unittest.TestCase):
    def setUp(self):
        self.place = Place()
        self.addCleanup(self.place.close)

    def over_ros(self, *arguments: str) -> None:
        command = self.place.start("rosrun", "cartpole", "workbench.py", *arguments)
        self.assertEqual(command.end(), 0, command.output)

    def here(self, *arguments: str) -> None:
        self.assertEqual(workbench.main(list(arguments)), 0)

    @unittest.skipUnless(HAS_SB3, "./ws extras isn't installed")
    def test_hindsight_learns_the_same_and_its_policy_acts_anywhere(self):
        params = ["her=true", "learning_starts=100", "net_arch=[16]",
                  "batch_size=16", "train_freq=2"]  # fmt: skip
        ros, here = self.place.folder / "ros", self.place.folder / "bullet"
        train = ["train", "--algo", "sac", "--env-id", ARM,
                 "--params", "eval_frequency=130", "eval_episodes=2", *params]  # fmt: skip
        self.over_ros(
            *train, "total_timesteps=150", "--env-kwargs", "backend=ros", "--run-dir", str(ros)
        )
        self.over_ros("train", "--resume", str(ros), "--total-timesteps", "300")
        self.here(
            *train, "total_timesteps=300", "--env-kwargs", "backend=bullet", "--run-dir", str(here)
        )
        self.assertEqual(figures(ros), figures(here))
        evaluated = [row.split(",")[0] for row in figures(ros) if ",eval/success_rate," in row]
        self.assertEqual(evaluated, ["130", "260", "300"])

        figures_file = self.place.folder / "figures.json"
        command = ["eval", str(ros), "--episodes", "2", "--json", str(figures_file)]
        returns = []
        for evaluate, backend in ((self.over_ros, "ros"), (self.here, "bullet")):
            evaluate(*command, "--env-kwargs", f"backend={backend}")
            returns.append(json.loads(figures_file.read_text())["returns"])
        self.assertEqual(*returns)
        self.assertEqual(self.place.left_after(), {})
