"""workbench.py with an arm that reaches for goals: the same figures over ROS as in-process.

Evaluations come in the midst of episodes, and move the robot that is learned with.
"""

import importlib.util
import json
import unittest
from pathlib import Path

from support.ros.programs import PlaceCase

from cartpole import workbench

ARM = "robot_envs/TwoLinkReachGoal-v0"
HAS_SB3 = importlib.util.find_spec("stable_baselines3") is not None


def figures(run: Path) -> list[str]:
    """What a training has logged, but for its speed and the clock."""
    with (run / "scalars.csv").open() as rows:
        return [",".join(row.split(",")[:3]) for row in rows if "SPS" not in row]


class WorkbenchGoals(PlaceCase):
    def here(self, *arguments: str) -> None:
        self.assertEqual(workbench.main(list(arguments)), 0)

    @unittest.skipUnless(HAS_SB3, "./ws extras isn't installed")
    def test_hindsight_learns_the_same_and_its_policy_acts_in_process(self):
        ros, here = self.place.folder / "ros", self.place.folder / "bullet"
        params = ["her=true", "learning_starts=100", "net_arch=[16]", "batch_size=16", "train_freq=2",
                  "buffer_size=1000", "eval_frequency=130", "eval_episodes=2"]  # fmt: skip

        def train(run, backend):
            return ["train", "--algo", "sac", "--env-id", ARM, "--env-kwargs", f"backend={backend}",
                    "--run-dir", str(run), "--params", "total_timesteps=300", *params]  # fmt: skip

        self.run_here("rosrun", "cartpole", "workbench.py", *train(ros, "ros"))
        self.here(*train(here, "bullet"))
        self.assertEqual(figures(ros), figures(here))
        evaluated = [row.split(",")[0] for row in figures(ros) if ",eval/success_rate," in row]
        self.assertEqual(evaluated, ["130", "260", "300"])

        figures_file = self.place.folder / "figures.json"
        options = ["--episodes", "2", "--json", str(figures_file)]
        returns = []
        for run in (ros, here):
            self.here("eval", str(run), *options, "--env-kwargs", "backend=bullet")
            returns.append(json.loads(figures_file.read_text())["returns"])
        self.assertEqual(*returns)
        self.assert_nothing_left()
