"""The bundled robots over ROS in lock-step: the bits of the in-process world, and the conformance suite."""

import unittest

import gymnasium
import numpy as np

import robot_envs.robots  # noqa: F401 - registers the environments
from robot_envs.testing import check_robot_env, differences, rollout
from robot_envs.world_state import InitialState, Push

# One of each robot; the others differ in what is made of the same numbers. A test ends with the robot, and so
# with the simulator, of the next one.
CASES = {
    "TwoLinkReachGoal": {}, "SixJointReach": {}, "PickCube": {}, "Furuta": {}, "DoublePendulum": {},
    "Hopper": {}, "Navigate": {}, "NavigateImages": {"world": "gates"},  # which swing
    "Quadruped": {},
}  # fmt: skip


class Robots(unittest.TestCase):
    def test_one_with_goals_keeps_what_environments_of_robots_promise(self):
        check_robot_env("robot_envs/TwoLinkReachGoal-v0", ("ros",), steps=30)

    def test_the_bits_are_those_of_the_robot_in_process(self):
        for name, options in CASES.items():
            with self.subTest(name):
                over_ros, here = (
                    gymnasium.make(f"robot_envs/{name}-v0", backend=backend, **options)
                    for backend in ("ros", "bullet")
                )
                for seed in (1, 2):  # the second time after other episodes
                    given = rollout(over_ros, 30, seed)
                    self.assertEqual(differences(given, rollout(here, 30, seed)), "")
                over_ros.close()
                here.close()

    def test_the_push_is_that_of_the_robot_in_process(self):
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
