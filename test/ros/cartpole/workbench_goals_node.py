#!/usr/bin/env python3
"""workbench.py with an arm that reaches for goals: over ROS, where there is one robot, as in this process.

Evaluations come in the midst of episodes, and move the robot that is learned with.
"""

import importlib.util
import json
import sys
import unittest
from pathlib import Path

import rostest

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "support"))

from pg_train_runs import Place

ARM = "robot_envs/TwoLinkReachGoal-v0"
HAS_SB3 = importlib.util.find_spec("stable_baselines3") is not None


class WorkbenchGoals(unittest.TestCase):
    def setUp(self):
        self.place = Place()
        self.addCleanup(self.place.close)

    def workbench(self, *arguments: str) -> str:
        command = self.place.start("rosrun", "cartpole", "workbench.py", *arguments)
        self.assertEqual(command.end(), 0, command.output)
        return command.output

    def figures(self, backend: str, algorithm: str, *params: str) -> list[str]:
        """What a training has logged, but for its speed and the clock."""
        run = self.place.folder / f"{algorithm}_{backend}"
        self.workbench("train", "--algo", algorithm, "--env-id", ARM, "--run-dir", str(run),
                       "--env-kwargs", f"backend={backend}",
                       "--params", "eval_frequency=130", "eval_episodes=2", *params)  # fmt: skip
        with (run / "scalars.csv").open() as rows:
            return [",".join(row.split(",")[:3]) for row in rows if "SPS" not in row]

    @unittest.skipUnless(HAS_SB3, "./ws extras isn't installed")
    def test_hindsight_learns_the_same_and_its_policy_acts_anywhere(self):
        params = ["her=true", "total_timesteps=300", "learning_starts=100", "net_arch=[16]",
                  "batch_size=16", "train_freq=2"]  # fmt: skip
        over_ros = self.figures("ros", "sac", *params)
        self.assertEqual(over_ros, self.figures("bullet", "sac", *params))
        evaluated = [row.split(",")[0] for row in over_ros if ",eval/success_rate," in row]
        self.assertEqual(evaluated, ["130", "260", "300"])

        run = str(self.place.folder / "sac_ros")
        returns = []
        for options in ([], ["--env-kwargs", "backend=bullet"]):
            figures = self.place.folder / "figures.json"
            self.workbench("eval", run, "--episodes", "2", "--json", str(figures), *options)
            returns.append(json.loads(figures.read_text())["returns"])
        self.assertEqual(*returns)
        self.assertEqual(self.place.left_after(), {})


if __name__ == "__main__":
    rostest.rosrun("cartpole", "workbench_goals", WorkbenchGoals)
