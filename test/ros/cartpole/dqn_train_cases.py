"""dqn_train.py as a ROS node."""

import json
import unittest

from support.ros.programs import Place


class DqnTrain(unittest.TestCase):
    def test_roslaunch_passes_parameters(self):
        place = Place()
        self.addCleanup(place.close)
        launched = place.start(
            "roslaunch", "cartpole", "dqn_train.launch", "total_timesteps:=300", "eval_frequency:=0",
            f"run_dir:={place.run}", "seed:=7", "params:=gamma=0.9 n_step=2",
        )  # fmt: skip
        launched.end()
        self.assertNotIn("Traceback", launched.output)
        config = json.loads((place.run / "config.json").read_text())
        self.assertEqual((config["run"]["seed"], config["run"]["total_timesteps"]), (7, 300))
        self.assertEqual(
            (config["hyperparameters"]["gamma"], config["hyperparameters"]["n_step"]), (0.9, 2)
        )
        self.assertIn("last.pt", place.files())
