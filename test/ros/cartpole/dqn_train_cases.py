"""dqn_train.py as a ROS node, and without ROS."""

import json
import unittest

from support.ros.programs import Place

from cartpole import dqn_train

SHORT = ["total_timesteps:=300", "eval_frequency:=0"]


class DqnTrain(unittest.TestCase):
    def place(self) -> Place:
        place = Place()
        self.addCleanup(place.close)
        return place

    def config(self, place: Place) -> dict:
        return json.loads((place.run / "config.json").read_text())

    def launched(self, place: Place, *arguments: str) -> str:
        launched = place.start("roslaunch", "cartpole", "dqn_train.launch", *SHORT, *arguments)
        launched.end()
        self.assertNotIn("Traceback", launched.output)
        return launched.output

    def test_roslaunch_passes_parameters(self):
        place = self.place()
        self.launched(place, f"run_dir:={place.run}", "seed:=7", "params:=gamma=0.9 n_step=2")
        config = self.config(place)
        self.assertEqual((config["run"]["seed"], config["run"]["total_timesteps"]), (7, 300))
        self.assertEqual(
            (config["hyperparameters"]["gamma"], config["hyperparameters"]["n_step"]), (0.9, 2)
        )
        self.assertIn("last.pt", place.files())

    def test_an_evaluation_over_ros_leaves_the_training_as_it_was(self):
        """There is one robot in one simulator; in this process there are two."""
        place = self.place()
        options = ["--env-id=cartpole/Classic-v0", "--total-timesteps=260", "--eval-frequency=70",
                   "--eval-episodes=2", "--confirm-episodes=3", "--learning-starts=50",
                   "--log-frequency=20"]  # fmt: skip
        figures = []
        for backend in ("ros", "bullet"):
            run = place.folder / backend
            flags = [f"--run-dir={run}", f"--env-kwargs=backend={backend}", *options]
            if backend == "ros":
                training = place.start("rosrun", "cartpole", "dqn_train.py", *flags)
                self.assertEqual(training.end(), 0, training.output)
            else:
                self.assertEqual(dqn_train.main(flags), 0)
            with (run / "scalars.csv").open() as rows:
                figures.append([row.split(",")[:3] for row in rows if "SPS" not in row])
        self.assertTrue(any(tag == "eval/mean_reward" for _, tag, _ in figures[0]))
        self.assertEqual(*figures)
        self.assertEqual(place.left_after(), {})

    def test_rosrun_needs_no_master_and_starts_none(self):
        place = Place("http://127.0.0.2:1")  # nobody answers there
        self.addCleanup(place.close)
        training = place.start("rosrun", "cartpole", "dqn_train.py", f"--run-dir={place.run}",
                               "--total-timesteps=300")  # fmt: skip
        self.assertEqual(training.end(), 0, training.output)
        self.assertEqual(place.processes(), {})
        self.assertIn("last.pt", place.files())
