#!/usr/bin/env python3
"""Gazebo's interface on MuJoCo: spawn, control, reset, place, step; and the error without MuJoCo."""

import importlib.util
import subprocess
import sys
import threading
import unittest

import rospy
import rostest
from bullet_gazebo_msgs.srv import StepWorld, StepWorldRequest
from gazebo_msgs.srv import GetLinkState, SetModelConfiguration
from sensor_msgs.msg import JointState
from std_srvs.srv import Empty
from support.ros.calls import BOUND, call, delete_model, spawn_model
from support.ros.manager import Manager
from support.ros.subscribed import wait_until_heard

STATES, CART = "joint_state_controller", "stand_cart_position_controller"
WITHOUT = """
import importlib.util, sys
find = importlib.util.find_spec
importlib.util.find_spec = lambda name, *more: None if name == "mujoco" else find(name, *more)
from bullet_gazebo.node.gzserver import main
sys.exit(main(["gzserver", "-e", "mujoco", "__name:=lonely"]))
"""


def step(ticks, controllers=(), commands=()):
    request = StepWorldRequest(ticks=ticks, controllers=controllers, commands=commands)
    return call("/gazebo/step_world", StepWorld, request)


@unittest.skipIf(importlib.util.find_spec("mujoco") is None, "mujoco is not installed")
class MujocoTest(unittest.TestCase):
    def setUp(self):
        self.assertTrue(spawn_model("cartpole", rospy.get_param("/robot_description")).success)
        self.addCleanup(delete_model)
        self.assertTrue(Manager().start(STATES, CART))
        call("/gazebo/reset_simulation", Empty)

    def test_it_is_mujoco_that_runs(self):
        """PyBullet would tell the pole's height in single precision."""
        state = call("/gazebo/get_link_state", GetLinkState, "cartpole::pole", "").link_state
        self.assertAlmostEqual(state.pose.position.z, 0.18, places=14)

    def test_the_cart_goes_where_its_controller_is_told(self):
        answer = step(1000, [CART], [0.1])
        self.assertTrue(answer.success, answer.status_message)
        self.assertAlmostEqual(answer.sim_time, 1.0, places=9)
        self.assertEqual(answer.joint_states.name, ["cart_pole", "stand_cart"])
        self.assertLess(abs(answer.joint_states.position[1] - 0.1), 0.05)

    def test_set_model_configuration_publishes_joint_states_and_a_reset_takes_it_back(self):
        moved = threading.Event()
        listener = rospy.Subscriber(
            "/joint_states", JointState, lambda m: m.position == (0.2, 0.5) and moved.set()
        )
        self.assertTrue(wait_until_heard("/joint_states"))
        place = call("/gazebo/set_model_configuration", SetModelConfiguration, "cartpole",
                     "robot_description", ["stand_cart", "cart_pole"], [0.7, 0.2])  # fmt: skip
        self.assertTrue(place.success)
        self.assertTrue(moved.wait(BOUND))  # without a step; the cart is clamped at its stop
        listener.unregister()
        call("/gazebo/reset_simulation", Empty)
        answer = step(1)
        self.assertAlmostEqual(answer.sim_time, 0.001, places=9)
        self.assertEqual(answer.joint_states.position, (0.0, 0.0))

    def test_without_it_the_simulator_says_how_to_get_it_and_ends(self):
        ended = subprocess.run(
            [sys.executable, "-c", WITHOUT],
            check=False, capture_output=True, text=True, timeout=BOUND,
        )  # fmt: skip
        self.assertEqual(ended.returncode, 1)
        lines = [line for line in ended.stderr.splitlines() if "mujoco" in line]
        self.assertEqual(len(lines), 1, ended.stderr)
        self.assertIn("/ws extras", lines[0])
        self.assertNotIn("Traceback", ended.stderr)


if __name__ == "__main__":
    rospy.init_node("engine_mujoco")
    rostest.rosrun("cartpole", "engine_mujoco", MujocoTest)
