"""The bundled robots over ROS in lock-step: the bits of the in-process world, and the conformance suite."""

import unittest

import gymnasium
import numpy as np

import robot_envs.robots  # noqa: F401 - registers the environments
from robot_envs.testing import check_robot_env, differences, rollout
from robot_envs.world_state import InitialState, Push

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

    def test_a_push_is_that_of_the_robot_in_process(self):
        pushes = [Push("quadruped::base", (0.0, 90.0, 10.0), 0.1, 0.1)]
        found = []
        for backend in ("ros", "bullet"):
            env = gymnasium.make("robot_envs/Quadruped-v0", backend=backend).unwrapped
            for initial in (InitialState(pushes=pushes), InitialState()):  # the second isn't pushed
                env.reset(seed=1, options={"initial_state": initial})
                found.append([env.step(np.zeros(15, np.float32))[0] for _ in range(12)])
            env.close()
        pushed, free, *here = found
        np.testing.assert_array_equal(here, [pushed, free])
        self.assertFalse(np.array_equal(pushed, free))

    def test_one_with_goals_keeps_what_environments_of_robots_promise(self):
        check_robot_env(IDS[0], ("ros",), steps=30)
