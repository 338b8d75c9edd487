#!/usr/bin/env python3
"""pg_train.py when something fails: one clear line within seconds, and progress is saved."""

import json
import signal

import rostest
from support.ros.programs import NETWORKS, PlaceCase, Process

ENDLESS = ("--episodes=100000", "--stop-at-length=0")


class PgTrainFaults(PlaceCase):
    def training(self, *flags: str) -> Process:
        training = self.place.train(*ENDLESS, *flags)
        training.wait_for("Episode   20 |")
        return training

    def assert_saved(self) -> dict:
        self.assertLessEqual(NETWORKS | {"learning_curve.png", "summary.json"}, self.place.files())
        summary = json.loads((self.place.run / "summary.json").read_text())
        self.assertGreaterEqual(summary["episodes"], 20)
        return summary

    def assert_failed(self, training: Process) -> dict:
        complaints = [line for line in self.ends(training, 1).splitlines() if "pg_train.py:" in line]
        self.assertEqual(len(complaints), 1, training.output)
        self.assertIn("progress is saved", complaints[0])
        summary = self.assert_saved()
        self.assertIsNotNone(summary["failure"])
        self.assert_nothing_left()
        return summary

    def test_a_second_one_at_the_same_master_is_refused_and_ctrl_c_saves_the_first(self):
        training = self.training()
        second = self.run_here("rosrun", "cartpole", "pg_train.py", "--episodes=1", code=1)
        self.assertIn("runs at", second)
        for _ in range(5):  # an impatient user
            training.interrupt()
        self.ends(training, 130)
        self.assertTrue(self.assert_saved()["interrupted"])
        self.assert_nothing_left()

    def test_ctrl_c_while_starting(self):
        training = self.place.train(*ENDLESS)
        training.wait_for("starting the simulator")
        training.interrupt()
        self.ends(training, 130)
        self.assert_nothing_left()
        self.assertFalse(self.place.run.exists())

    def test_a_simulator_that_hangs(self):
        training = self.training()
        self.place.send_to_simulator(signal.SIGSTOP)
        self.assert_failed(training)
        self.assertIn("no answer within 5", training.output)  # and the time of the steps


if __name__ == "__main__":
    rostest.rosrun("cartpole", "pg_train_faults", PgTrainFaults)
