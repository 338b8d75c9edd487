#!/usr/bin/env python3
"""workbench.py with an arm that reaches for goals: the same figures over ROS as in-process.

Evaluations come in the midst of episodes, and move the robot that is learned with. Halfway, in the midst of
an episode, the training over ROS ends with its simulator, and is gone on with in another one.
"""

import importlib.util
import json
import unittest
from pathlib import Path

import rostest
from support.ros.pg_train_runs import Place

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

    def workbench(self, *arguments: str) -> str:
        command = self.place.start("rosrun", "cartpole", "workbench.py", *arguments)
        self.assertEqual(command.end(), 0, command.output)
        return command.output

    def train(self, backend: str, run: Path, *params: str) -> None:
        self.workbench("train", "--algo", "sac", "--env-id", ARM, "--run-dir", str(run),
                       "--env-kwargs", f"backend={backend}",
                       "--params", "eval_frequency=130", "eval_episodes=2", *params)  # fmt: skip

    @unittest.skipUnless(HAS_SB3, "./ws extras isn't installed")
    def test_hindsight_learns_the_same_and_its_policy_acts_anywhere(self):
        params = ["her=true", "learning_starts=100", "net_arch=[16]",
                  "batch_size=16", "train_freq=2"]  # fmt: skip
        run = self.place.folder / "sac_ros"
        self.train("ros", run, *params, "total_timesteps=150")
        self.workbench("train", "--resume", str(run), "--total-timesteps", "300")
        over_ros = figures(run)
        here = self.place.folder / "sac_bullet"
        self.train("bullet", here, *params, "total_timesteps=300")
        self.assertEqual(over_ros, figures(here))
        evaluated = [row.split(",")[0] for row in over_ros if ",eval/success_rate," in row]
        self.assertEqual(evaluated, ["130", "260", "300"])

        returns = []
        for options in ([], ["--env-kwargs", "backend=bullet"]):
            found = self.place.folder / "figures.json"
            self.workbench("eval", str(run), "--episodes", "2", "--json", str(found), *options)
            returns.append(json.loads(found.read_text())["returns"])
        self.assertEqual(*returns)
        self.assertEqual(self.place.left_after(), {})


if __name__ == "__main__":
    rostest.rosrun("cartpole", "workbench_goals", WorkbenchGoals)
