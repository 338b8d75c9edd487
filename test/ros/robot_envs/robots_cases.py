"""The bundled robots over ROS in lock-step: the bits of the in-process world, and the conformance suite."""

import unittest

import gymnasium

import robot_envs.robots  # noqa: F401 - registers the environments
from robot_envs.testing import check_robot_env, differences, rollout

# One of each robot; the others differ in what is made of the same numbers.
IDS = tuple(
    f"robot_envs/{name}-v0"
    for name in (
        "TwoLinkReachGoal",
        "SixJointReach",
        "PickCube",
        "Furuta",
        "DoublePendulum",
        "Hopper",
        "Quadruped",
    )
)
CASES = (
    *((each, {}) for each in IDS),
    ("robot_envs/Navigate-v0", {}),
    ("robot_envs/NavigateImages-v0", {"world": "gates"}),  # which swing
)


class Robots(unittest.TestCase):
    def test_the_bits_are_those_of_the_robot_in_process(self):
        for identifier, options in CASES:
            with self.subTest(identifier):
                over_ros, here = (
                    gymnasium.make(identifier, backend="ros", **options),
                    gymnasium.make(identifier, **options),
                )
                for seed in (1, 2):  # the second time after other episodes
                    given = rollout(over_ros, 30, seed)
                    self.assertEqual(differences(given, rollout(here, 30, seed)), "")
                over_ros.close()
                here.close()

    def test_one_with_goals_keeps_what_environments_of_robots_promise(self):
        check_robot_env(IDS[0], ("ros",), steps=30)
