#!/usr/bin/env python3
"""The step service: exact ticks, repeatable bits, several clients."""

import threading
import unittest

import rospy
import rostest
from bullet_gazebo_msgs.srv import StepWorld, StepWorldRequest
from crowd_cases import CrowdTest
from gazebo_msgs.srv import GetWorldProperties
from snapshots_cases import SnapshotsTest
from std_srvs.srv import Empty
from support.ros.calls import BOUND, spawn_model
from support.ros.manager import Manager

__all__ = ["CrowdTest", "LockstepTest", "SnapshotsTest"]
STATES, CART = "joint_state_controller", "stand_cart_position_controller"


def proxy(name, kind):
    rospy.wait_for_service(name, BOUND)
    return rospy.ServiceProxy(name, kind, persistent=True)


class LockstepTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        xml = rospy.get_param("/robot_description")
        assert spawn_model("cartpole", xml).success
        assert Manager().start(STATES, CART)
        cls.call = staticmethod(proxy("/gazebo/step_world", StepWorld))
        cls.reset = staticmethod(proxy("/gazebo/reset_simulation", Empty))
        cls.world = staticmethod(proxy("/gazebo/get_world_properties", GetWorldProperties))

    def setUp(self):
        self.reset()

    def step(self, ticks, controllers=(), commands=(), **more):
        request = StepWorldRequest(ticks=ticks, controllers=controllers, commands=commands, **more)
        return self.call(request)

    def test_time_moves_by_exactly_the_ticks_asked_for(self):
        for ticks, time in ((1, 0.001), (8, 0.009), (100, 0.109)):
            answer = self.step(ticks, [], [])
            self.assertTrue(answer.success, answer.status_message)
            self.assertAlmostEqual(answer.sim_time, time, places=9)
            self.assertAlmostEqual(answer.joint_states.header.stamp.to_sec(), time, places=9)
        self.assertAlmostEqual(self.world().sim_time, 0.109, places=9)

    def test_unpause_does_not_start_time(self):
        proxy("/gazebo/unpause_physics", Empty)()
        threading.Event().wait(0.1)
        self.assertEqual(self.world().sim_time, 0.0)

    def test_a_command_acts_from_the_first_tick_on(self):
        answer = self.step(1, [CART], [0.02])
        self.assertEqual(answer.joint_states.name, ["cart_pole", "stand_cart"])
        # The kick of docs/contract/ros_control.md 4, clipped.
        self.assertEqual(answer.joint_states.effort, (0.0, 30.0))

    def test_an_episode_begins_in_one_call(self):
        self.step(50, [CART], [0.3])
        place = {"joints": ["stand_cart", "cart_pole"], "positions": [0.1, -0.2]}
        answer = self.step(0, reset=StepWorldRequest.SIMULATION, **place, velocities=[0.5, 1.5])
        self.assertTrue(answer.success, answer.status_message)
        self.assertEqual(answer.sim_time, 0.0)
        self.assertEqual(answer.joint_states.position, (-0.2, 0.1))
        self.assertEqual(answer.joint_states.velocity, (1.5, 0.5))
        self.assertEqual(answer.joint_states.effort, (0.0, 0.0))
        # The controller holds where it was put, and knows no past: its first error is 0.
        self.assertEqual(self.step(1).joint_states.effort[1], 0.0)

    def test_a_long_step_lets_other_services_answer(self):
        step = proxy("/gazebo/step_world", StepWorld)
        worker = threading.Thread(target=step, args=(StepWorldRequest(ticks=100_000),))
        worker.start()
        seen = set()
        while worker.is_alive():
            seen.add(self.world().sim_time)
        self.assertGreater(len(seen), 3)
        self.assertAlmostEqual(self.world().sim_time, 100.0, places=6)


if __name__ == "__main__":
    rospy.init_node("lockstep_test")
    rostest.rosrun("cartpole", "lockstep", "__main__")
