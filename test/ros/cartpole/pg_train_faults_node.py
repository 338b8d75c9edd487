#!/usr/bin/env python3
"""pg_train.py when something fails: one clear line within seconds, and progress is saved."""

import json
import signal
import unittest

import rostest
from support.ros.programs import NETWORKS, Place, Process

ENDLESS = ("--episodes=100000", "--stop-at-length=0")


class PgTrainFaults(unittest.TestCase):
    def place(self, master: str | None = None) -> Place:
        place = Place(master)
        self.addCleanup(place.close)
        return place

    def training(self, place: Place, *flags: str) -> Process:
        training = place.train(*ENDLESS, *flags)
        training.wait_for("Episode   20 |")
        return training

    def assert_saved(self, place: Place) -> dict:
        self.assertLessEqual(NETWORKS | {"learning_curve.png", "summary.json"}, place.files())
        summary = json.loads((place.run / "summary.json").read_text())
        self.assertGreaterEqual(summary["episodes"], 20)
        return summary

    def assert_failed(self, place: Place, training: Process) -> None:
        self.assertEqual(training.end(), 1, training.output)
        self.assertNotIn("Traceback", training.output)
        complaints = [line for line in training.output.splitlines() if "pg_train.py:" in line]
        self.assertEqual(len(complaints), 1, training.output)
        self.assertIn("progress is saved", complaints[0])
        self.assertIsNotNone(self.assert_saved(place)["failure"])
        self.assertEqual(place.left_after(), {})

    def test_a_second_one_at_the_same_master_is_refused_and_ctrl_c_saves_the_first(self):
        place = self.place()
        training = self.training(place)
        second = place.start("rosrun", "cartpole", "pg_train.py", "--episodes=1")
        self.assertEqual(second.end(), 1, second.output)
        self.assertIn("runs at", second.output)
        for _ in range(5):  # an impatient user
            training.interrupt()
        self.assertEqual(training.end(), 130, training.output)
        self.assertNotIn("Traceback", training.output)
        self.assertTrue(self.assert_saved(place)["interrupted"])
        self.assertEqual(place.left_after(), {})

    def test_ctrl_c_while_starting(self):
        place = self.place()
        training = place.train(*ENDLESS)
        training.wait_for("starting the simulator")
        training.interrupt()
        self.assertEqual(training.end(), 130, training.output)
        self.assertNotIn("Traceback", training.output)
        self.assertEqual(place.left_after(), {})
        self.assertFalse(place.run.exists())

    def test_a_simulator_that_dies_in_real_time(self):
        place = self.place()
        training = self.training(place, "--realtime")
        place.send_to_simulator(signal.SIGKILL)
        self.assert_failed(place, training)
        lengths = json.loads((place.run / "summary.json").read_text())["lengths"]
        self.assertGreater(min(lengths), 1)

    def test_a_simulator_that_hangs(self):
        place = self.place()
        training = self.training(place)
        place.send_to_simulator(signal.SIGSTOP)
        self.assert_failed(place, training)
        self.assertIn("no answer within 5", training.output)  # and the time of the steps

    def test_the_simulator_that_takes_its_own_ones_place_lives_on(self):
        place = self.place()
        core = place.start("roscore", "-p", place.environment["ROS_MASTER_URI"].rpartition(":")[2])
        core.wait_for("started core service")
        training = self.training(place)
        other = place.start("rosrun", "gazebo_ros", "gzserver", "--replace", "--lockstep")
        self.assertEqual(training.end(), 1, training.output)
        self.assertIn("another one runs as /gazebo", training.output)
        self.assert_saved(place)
        question = place.start("rosservice", "call", "/gazebo/get_world_properties")
        self.assertEqual(question.end(), 0, question.output + other.output)
        other.interrupt()
        self.assertEqual(other.end(), 0, other.output)
        core.interrupt()
        self.assertEqual(place.left_after(), {})


if __name__ == "__main__":
    rostest.rosrun("cartpole", "pg_train_faults", PgTrainFaults)
