#!/usr/bin/env python3
"""Trainings over ROS besides pg_train's: DQN, Stable-Baselines3, goals in the workbench."""

import json
import unittest
from pathlib import Path

import rostest
from support.ros.programs import PlaceCase
from workbench_goals_cases import HAS_SB3, WorkbenchGoals

__all__ = ["DqnTrain", "ReadmePpo", "WorkbenchGoals"]


class DqnTrain(PlaceCase):
    def test_roslaunch_passes_parameters(self):
        self.run_here(
            "roslaunch", "cartpole", "dqn_train.launch", "total_timesteps:=300", "eval_frequency:=0",
            f"run_dir:={self.place.run}", "seed:=7", "params:=gamma=0.9 n_step=2 confirm_episodes=1",
        )  # fmt: skip
        config = json.loads((self.place.run / "config.json").read_text())
        self.assertEqual((config["run"]["seed"], config["run"]["total_timesteps"]), (7, 300))
        own = config["hyperparameters"]
        self.assertEqual((own["gamma"], own["n_step"]), (0.9, 2))
        self.assertIn("last.pt", self.place.files())


@unittest.skipUnless(HAS_SB3, "./ws extras isn't installed")
class ReadmePpo(PlaceCase):
    """examples/ppo_over_ros.py runs unchanged, but for fewer steps."""

    def test_it_trains_over_ros_and_leaves_nothing(self):
        root = Path(__file__).resolve().parents[3]
        code = (root / "examples/ppo_over_ros.py").read_text()
        self.assertIn("60_000", code)
        self.assertIn("n_eval_episodes=5", code)
        script = self.place.folder / "ppo.py"
        script.write_text(code.replace("60_000", "1_024").replace("episodes=5", "episodes=1"))
        output = self.run_here("python3", str(script))
        # It says how far it is, what it came to, and leaves what it learned.
        self.assertRegex(output, r"total_timesteps +\| 1024 ")
        self.assertIn("ep_len_mean", output)
        self.assertRegex(output, r"steps of 500: \d+\.\d+\s*\Z")
        self.assertGreater((self.place.folder / "ppo_cartpole.zip").stat().st_size, 10_000)
        self.assert_nothing_left()


if __name__ == "__main__":
    rostest.rosrun("cartpole", "trainings", "__main__")
