#!/usr/bin/env python3
"""pg_train.py from nothing: it trains, writes its files, and leaves no process behind."""

import contextlib
import json
import os
import signal

import rostest
import torch
from support.ros.programs import NETWORKS, PlaceCase
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


class PgTrain(PlaceCase):
    def test_from_nothing_by_its_launch_file(self):
        run = self.place.run
        output = self.run_here(
            "roslaunch", "cartpole", "pg_train.launch", "episodes:=5", "seed:=2", "save_every:=4",
            "gui:=true", f"run_dir:={run}", "params:=gamma=0.98 eval_episodes=1",
        )  # fmt: skip
        self.assert_nothing_left(output)
        self.assertIn("the window is the page http://127.0.0.1:", output)
        self.assertIn("trained 5 episodes", output)
        self.assertIn(str(run), output)
        others = {"learning_curve.png", "summary.json", "policy_network_episode_4.pth"}
        self.assertLessEqual(NETWORKS | others, self.place.files())
        record = json.loads((run / "config.json").read_text())
        self.assertEqual((record["run"]["episodes"], record["run"]["seed"]), (5, 2))
        self.assertEqual(record["hyperparameters"]["gamma"], 0.98)
        log = EventAccumulator(str(run))
        log.Reload()
        self.assertEqual(set(log.Tags()["scalars"]), TAGS)
        self.assertEqual([point.step for point in log.Scalars("Reward")], [0, 1, 2, 3, 4])

    def assert_same_weights(self, one, other):
        for name in NETWORKS:
            ours, theirs = (torch.load(place.run / name, weights_only=True) for place in (one, other))
            self.assertEqual(ours.keys(), theirs.keys())
            self.assertTrue(all(torch.equal(ours[key], theirs[key]) for key in ours), name)

    def test_over_ros_killed_and_resumed_the_weights_are_those_of_one_go_in_this_process(self):
        """The same seed gives the same weights, whatever moves the robot."""
        flags = ("--start-noise=0.05", "--episodes=30", "--eval-episodes=1", "--seed=4",
                 "--checkpoint-frequency=60")  # fmt: skip
        inside, killed = self.place, self.new_place()
        self.assertEqual(pg_train.main([f"--run-dir={inside.run}", *flags, "--backend=bullet"]), 0)
        training = killed.train(*flags)
        training.wait_for("Episode   20 |")
        for pid in killed.processes():
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        training.end()
        resumed = killed.start("rosrun", "cartpole", "pg_train.py", f"--resume={killed.run}")
        self.assertIn("resuming at step", self.ends(resumed))
        self.assert_same_weights(inside, killed)
        self.assertEqual(killed.left_after(), {})

    def test_a_simulator_that_is_there_is_used_and_left_as_it_was(self):
        place = self.place
        world = place.start("roslaunch", "cartpole", "simulation.launch")
        world.wait_for("starting joint_state_controller")
        world.wait_for("process has finished cleanly")
        before = set(place.processes())
        deleted = self.run_here("rosservice", "call", "/gazebo/delete_model", "cartpole")
        self.assertIn("True", deleted)
        # It has no window: one is opened.
        output = self.ends(place.train("--episodes=2", "--eval-episodes=1", "--gui"))
        self.assertNotIn("starting the simulator", output)
        self.assertIn("opening the simulator's window", output)
        self.assertIn("the window is the page http://127.0.0.1:", output)
        self.assertEqual(set(place.processes()), before)
        properties = self.run_here("rosservice", "call", "/gazebo/get_world_properties")
        self.assertNotIn("cartpole", properties)
        world.interrupt()
        world.end()
        self.assert_nothing_left()


if __name__ == "__main__":
    rostest.rosrun("cartpole", "pg_train", PgTrain)
