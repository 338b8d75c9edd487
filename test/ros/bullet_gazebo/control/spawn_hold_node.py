#!/usr/bin/env python3
"""No step between a model's appearance and its drives, however slowly its plugins load."""

import importlib.util
import threading
import unittest

import rospy
import rostest
from gazebo_msgs.srv import (
    DeleteModel,
    GetJointProperties,
    GetPhysicsProperties,
    GetWorldProperties,
    SpawnModel,
    SpawnModelRequest,
)
from std_srvs.srv import Empty, EmptyResponse

BOUND = 60.0  # [s of wall time]
CALLS = 100  # while plugins load; each takes as long as several ticks
FALL = 0.5  # [s of simulated time]


def call(name, kind, *args):
    rospy.wait_for_service(name, BOUND)
    return rospy.ServiceProxy(name, kind)(*args)


def sim_time():
    return call("/gazebo/get_world_properties", GetWorldProperties).sim_time


def position(joint):
    return call("/gazebo/get_joint_properties", GetJointProperties, joint).position[0]


def can_run():
    return rospy.get_param("/physics") != "mujoco" or importlib.util.find_spec("mujoco") is not None


@unittest.skipUnless(can_run(), "mujoco is not installed")
class SpawnHoldTest(unittest.TestCase):
    def setUp(self):
        self.loading, self.go_on = threading.Event(), threading.Event()
        self.service = rospy.Service("/loading", Empty, self.load)
        self.answers = []

    def tearDown(self):
        self.go_on.set()
        call("/gazebo/delete_model", DeleteModel, "lifts")
        self.service.shutdown()

    def load(self, request):
        self.loading.set()
        self.assertTrue(self.go_on.wait(BOUND))
        return EmptyResponse()

    def spawn(self):
        request = SpawnModelRequest(
            model_name="lifts", model_xml=rospy.get_param("/robot_description"), robot_namespace="/"
        )
        answer = call("/gazebo/spawn_urdf_model", SpawnModel, request)
        self.answers.append(answer.success)

    def pass_time(self, seconds):
        end = sim_time() + seconds
        pause = threading.Event()
        for _ in range(int(BOUND / 0.01)):
            if sim_time() >= end:
                return
            pause.wait(0.01)
        self.fail("time doesn't pass")

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
