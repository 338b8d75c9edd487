#!/usr/bin/env python3
"""The robots that come along give over ROS in lock-step the bits that they give in this process."""

import sys
import unittest
from pathlib import Path

import gymnasium
import rostest

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "support"))

from scenes.rollout import rollout, same

import robot_envs.robots  # noqa: F401 - registers the environments

# One of each robot; the others differ in what is made of the same numbers.
IDS = tuple(
    f"robot_envs/{name}-v0"
    for name in ("TwoLinkReachGoal", "SixJointReach", "Furuta", "DoublePendulum", "Hopper")
)


class Robots(unittest.TestCase):
    def test_the_bits_are_those_of_the_robot_in_process(self):
        for identifier in IDS:
            with self.subTest(identifier):
                over_ros, here = (
                    gymnasium.make(identifier, backend="ros"),
                    gymnasium.make(identifier),
                )
                for seed in (1, 2):  # the second time after other episodes
                    self.assertTrue(same(rollout(over_ros, 30, seed), rollout(here, 30, seed)))
                over_ros.close()
                here.close()


if __name__ == "__main__":
    rostest.rosrun("cartpole", "robots", Robots)
