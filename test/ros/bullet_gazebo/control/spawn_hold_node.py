#!/usr/bin/env python3
"""A spawned model takes no step before its drives exist, however slowly its plugins load."""

import threading
import unittest

import rospy
import rostest
from gazebo_msgs.srv import GetJointProperties, GetPhysicsProperties
from std_srvs.srv import Empty, EmptyResponse
from support.ros.calls import BOUND, call, delete_model, sim_time, spawn_model, wait_until

CALLS = 100  # while plugins load; each takes as long as several ticks
FALL = 0.5  # [s of simulated time]


def position(joint):
    return call("/gazebo/get_joint_properties", GetJointProperties, joint).position[0]


class SpawnHoldTest(unittest.TestCase):
    def setUp(self):
        self.loading, self.go_on = threading.Event(), threading.Event()
        self.service = rospy.Service("/loading", Empty, self.load)
        self.answers = []

    def tearDown(self):
        self.go_on.set()
        delete_model("lifts")
        self.service.shutdown()

    def load(self, request):
        self.loading.set()
        self.assertTrue(self.go_on.wait(BOUND))
        return EmptyResponse()

    def spawn(self):
        self.answers.append(spawn_model("lifts", rospy.get_param("/robot_description")).success)

    def pass_time(self, seconds):
        end = sim_time() + seconds
        self.assertTrue(wait_until(lambda: sim_time() >= end), "time doesn't pass")

    def test_joints_hold_the_pose_that_they_were_spawned_at(self):
        self.pass_time(0.1)  # it runs
        thread = threading.Thread(target=self.spawn)
        thread.start()
        self.assertTrue(self.loading.wait(BOUND))
        held = {sim_time() for _ in range(CALLS)}
        self.assertEqual(len(held), 1, "time passes while plugins load")
        self.assertEqual([position(each) for each in ("held", "braked", "free")], [0.0, 0.0, 0.0])
        # It is not paused for that; who pauses and unpauses doesn't let it run.
        self.assertFalse(call("/gazebo/get_physics_properties", GetPhysicsProperties).pause)
        call("/gazebo/pause_physics", Empty)
        call("/gazebo/unpause_physics", Empty)
        self.assertEqual(sim_time(), held.pop())
        self.go_on.set()
        thread.join(BOUND)
        self.assertEqual(self.answers, [True])
        self.pass_time(FALL)
        # No controller has come yet: that isn't needed.
        self.assertAlmostEqual(position("held"), 0.0, places=4)
        self.assertAlmostEqual(position("braked"), 0.0, places=2)
        self.assertLess(position("free"), -0.9 * 4.9 * FALL**2)


if __name__ == "__main__":
    rospy.init_node("spawn_hold")
    rostest.rosrun("cartpole", "spawn_hold", SpawnHoldTest)
