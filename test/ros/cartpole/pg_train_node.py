#!/usr/bin/env python3
"""pg_train.py from nothing: it trains, writes its files, and leaves no process behind."""

import contextlib
import json
import os
import signal
import unittest

import rostest
import torch
from support.ros.programs import NETWORKS, Place
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from cartpole import pg_train

TAGS = {
    "Reward",
    "Value Loss",
    "Policy Loss",
    "charts/episodic_return",
    "charts/episodic_length",
    "charts/SPS",
    "losses/policy_loss",
    "losses/value_loss",
    "eval/mean_reward",
}


class PgTrain(unittest.TestCase):
    def place(self) -> Place:
        place = Place()
        self.addCleanup(place.close)
        return place

    def test_from_nothing_by_its_launch_file(self):
        place = self.place()
        training = place.start(
            "roslaunch", "cartpole", "pg_train.launch", "episodes:=5", "seed:=2", "save_every:=4",
            "gui:=true", f"run_dir:={place.run}", "params:=gamma=0.98",
        )  # fmt: skip
        training.end()
        output = training.output
        self.assertEqual(place.left_after(), {}, output)
        self.assertNotIn("Traceback", output)
        self.assertIn("the window is the page http://127.0.0.1:", output)
        self.assertIn("trained 5 episodes", output)
        self.assertIn(str(place.run), output)
        self.assertLessEqual(
            NETWORKS | {"learning_curve.png", "summary.json", "policy_network_episode_4.pth"},
            place.files(),
        )
        record = json.loads((place.run / "config.json").read_text())
        self.assertEqual((record["run"]["episodes"], record["run"]["seed"]), (5, 2))
        self.assertEqual(record["hyperparameters"]["gamma"], 0.98)
        log = EventAccumulator(str(place.run))
        log.Reload()
        self.assertEqual(set(log.Tags()["scalars"]), TAGS)
        self.assertEqual([point.step for point in log.Scalars("Reward")], [0, 1, 2, 3, 4])

    def assert_same_weights(self, one, other):
        for name in NETWORKS:
            ours, theirs = (
                torch.load(place.run / name, weights_only=True) for place in (one, other)
            )
            self.assertEqual(ours.keys(), theirs.keys())
            self.assertTrue(all(torch.equal(ours[key], theirs[key]) for key in ours), name)

    def test_over_ros_killed_and_resumed_the_weights_are_those_of_one_go_in_this_process(self):
        """With a simulator for each of two environments: the same seed gives the same weights, whatever
        moves the robots."""
        flags = ("--start-noise=0.05", "--episodes=30", "--eval-episodes=1", "--num-envs=2", "--seed=4",
                 "--checkpoint-frequency=60")  # fmt: skip
        inside = self.place()
        self.assertEqual(pg_train.main([f"--run-dir={inside.run}", *flags, "--backend=bullet"]), 0)
        killed = self.place()
        training = killed.train(*flags)
        training.wait_for("Episode   20 |")
        for pid in killed.processes():
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        training.end()
        resumed = killed.start("rosrun", "cartpole", "pg_train.py", f"--resume={killed.run}")
        self.assertEqual(resumed.end(), 0, resumed.output)
        self.assertIn("resuming at step", resumed.output)
        self.assert_same_weights(inside, killed)
        self.assertEqual(killed.left_after(), {})

    def test_a_simulator_that_is_there_is_used_and_left_as_it_was(self):
        place = self.place()
        world = place.start("roslaunch", "cartpole", "simulation.launch")
        world.wait_for("starting joint_state_controller")
        world.wait_for("process has finished cleanly")
        before = set(place.processes())
        self.assertIn("True", self.ask(place, "/gazebo/delete_model", "cartpole"))
        training = place.train("--episodes=2", "--gui")  # it has no window: one is opened
        self.assertEqual(training.end(), 0, training.output)
        self.assertNotIn("Traceback", training.output)
        self.assertNotIn("starting the simulator", training.output)
        self.assertIn("opening the simulator's window", training.output)
        self.assertIn("the window is the page http://127.0.0.1:", training.output)
        self.assertEqual(set(place.processes()), before)
        self.assertNotIn("cartpole", self.ask(place, "/gazebo/get_world_properties"))
        world.interrupt()
        world.end()
        self.assertEqual(place.left_after(), {})

    def ask(self, place: Place, service: str, *request: str) -> str:
        asked = place.start("rosservice", "call", service, *request)
        self.assertEqual(asked.end(), 0, asked.output)
        return asked.output


if __name__ == "__main__":
    rostest.rosrun("cartpole", "pg_train", PgTrain)
