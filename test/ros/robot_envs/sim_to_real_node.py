#!/usr/bin/env python3
"""Sensor and actuator imperfections and varied robots over ROS: the bits of the in-process world."""

import sys
import unittest

import numpy as np
import rospy
import rostest
from gazebo_msgs.srv import GetLinkProperties, GetPhysicsProperties
from gymnasium.utils.env_checker import data_equivalence as same
from support.robots.rig import MASS, RIG, SLEDGE, make_both, make_rig

from robot_envs import SimulatorError
from robot_envs.backends.ros.running import SimulatorService
from robot_envs.backends.ros.session import RosSession
from robot_envs.variation import Variation

REALTIME = "ros-realtime" in sys.argv
GAINS = "/rig/servo_position/pid"
VARIED = {
    "mass": 0.3, "length": 0.2, "com": 0.01, "damping": 0.5, "friction": {"rig::rail": (0.1, 0.5)},
    "surface_friction": 0.5, "gains": 0.3, "gravity": 0.1,
}  # fmt: skip
OPTIONS = {
    "sensor_noise": (0.01, 0.1), "sensor_delay": 2, "encoder_step": 0.001, "action_delay": 3,
    "actuator_limit": {"/rig/motors": 4.0, "/rig/servo_position": 0.5}, "actuator_lag": 0.03,
}  # fmt: skip


def rollout(env, steps=100):
    """All that two episodes tell."""
    rng, told = np.random.default_rng(1), [env.reset(seed=5)]
    for step in range(steps):
        told.append(env.step(rng.uniform(-1.0, 1.0, 3) * [5.0, 20.0, 0.5]))
        if step == steps // 2:
            told.append(env.reset())
    env.close()
    return told


def figures():
    """What Gazebo's services and the parameters tell of the rig."""
    link = SimulatorService("/gazebo/get_link_properties", GetLinkProperties)("rig::cart")
    world = SimulatorService("/gazebo/get_physics_properties", GetPhysicsProperties)()
    gains = {name: rospy.get_param(f"{GAINS}/{name}") for name in ("p", "i", "d", "i_clamp_max")}
    return link.mass, link.com.position.x, link.ixx, link.gravity_mode, world.gravity.z, gains


OWN = (MASS, 0.0, 0.1, True, -9.8, {"p": 20.1, "i": 0.5, "d": 2.3, "i_clamp_max": 1.0})


class Session(unittest.TestCase):
    """One for all, since a process becomes a ROS node once."""

    @classmethod
    def setUpClass(cls):
        robots = RIG if REALTIME else [RIG, SLEDGE]
        session = RosSession(robots, "/learner", [], realtime=REALTIME, gui=False, seed=0)
        cls.addClassCleanup(session.close)
        session.start(print)


@unittest.skipIf(REALTIME, "time runs by itself")
class Lockstep(Session):
    def assert_same_bits(self, **options):
        over_ros, here = (rollout(make_both(backend, **options)) for backend in ("ros", "bullet"))
        for one, other in zip(over_ros, here, strict=True):
            self.assertTrue(same(one, other, exact=True), (options, one, other))
        return here

    def test_each_option_alone_gives_the_bits_of_the_world_in_process(self):
        plain = self.assert_same_bits()
        for options in (
            *({name: value} for name, value in OPTIONS.items()),
            *({"randomisation": {name: value}} for name, value in VARIED.items()),
        ):
            run = self.assert_same_bits(**options)
            same_seen = [np.array_equal(a[0], b[0]) for a, b in zip(run, plain, strict=True)]
            self.assertFalse(all(same_seen), f"{options} isn't felt")

    def test_all_together_do_so_too(self):
        self.assert_same_bits(randomisation=VARIED, **OPTIONS)

    def test_it_is_given_back_as_it_was_found(self):
        plain = rollout(make_both())
        varied = make_both("ros", randomisation=VARIED)
        info = varied.reset(seed=0)[1]["variation"]
        mass, _, _, gravity_mode, gravity, gains = figures()
        self.assertEqual(mass, MASS * info["mass"]["rig::cart"])
        self.assertTrue(gravity_mode)
        self.assertEqual(gravity, -9.8 * info["gravity"])
        factor = info["gains"]["/rig/servo_position"]
        self.assertEqual(
            gains, {"p": 20.1 * factor, "i": 0.5 * factor, "d": 2.3 * factor, "i_clamp_max": 1.0}
        )
        varied.close()
        self.assertEqual(figures(), OWN)
        for one, other in zip(plain, rollout(make_both("ros")), strict=True):
            self.assertTrue(same(one, other, exact=True))


@unittest.skipIf(not REALTIME, "time runs in steps")
class Realtime(Session):
    def test_what_gazebos_services_can_change_differs_and_is_given_back(self):
        options = {"mass": {"cart": 0.3}, "com": 0.01, "damping": 0.5, "gains": 0.3, "gravity": 0.1}
        env = make_rig("ros-realtime", randomisation=options, **{**OPTIONS, "actuator_limit": 4.0})
        info = env.reset(seed=0)[1]["variation"]
        self.assertEqual(figures()[0], MASS * info["mass"]["cart"])
        self.assertEqual(figures()[4], -9.8 * info["gravity"])
        self.assertTrue(np.isfinite(env.step(np.zeros(3))[0]).all())
        env.close()
        self.assertEqual(figures(), OWN)

    def test_surfaces_are_refused_with_the_reason(self):
        env = make_rig("ros-realtime")
        self.addCleanup(env.close)
        with self.assertRaisesRegex(SimulatorError, "set_link_friction: the simulator isn't in lock-step"):
            env.backend.vary(Variation(surfaces={"cart": 0.5}))


if __name__ == "__main__":
    rostest.rosrun("cartpole", "sim_to_real", Realtime if REALTIME else Lockstep, sys.argv)
