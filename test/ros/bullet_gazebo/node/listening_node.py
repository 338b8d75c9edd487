#!/usr/bin/env python3
"""The workspace's nodes and Debian's in one launch: what they import, and where they listen."""

import importlib
import unittest

import rospy
import rostest
from listening_cases import Listening
from nodelet.srv import NodeletList
from std_msgs.msg import String

__all__ = ["Listening", "Workspace"]


class Workspace(unittest.TestCase):
    def test_imports(self):
        for name in (
            "torch", "pybullet", "gazebo_msgs.srv", "control_msgs.msg", "controller_manager_msgs.srv",
            "bullet_gazebo_msgs.srv", "bullet_gazebo", "robot_sim", "ros_utils",
        ):  # fmt: skip
            with self.subTest(name):
                importlib.import_module(name)

    def test_master(self):
        publisher = rospy.Publisher("said", String, queue_size=1, latch=True)
        publisher.publish("hello")
        heard = rospy.wait_for_message("said", String, timeout=60)
        self.assertEqual(heard.data, "hello")

    def test_topic_tools(self):
        publisher = rospy.Publisher("fast", String, queue_size=1, latch=True)
        publisher.publish("once")
        self.assertEqual(rospy.wait_for_message("slow", String, timeout=60).data, "once")

    def test_nodelet(self):
        rospy.wait_for_service("manager/list", timeout=60)
        self.assertEqual(rospy.ServiceProxy("manager/list", NodeletList)().nodelets, [])


if __name__ == "__main__":
    rospy.init_node("listening")
    rostest.rosrun("cartpole", "listening", "__main__")
