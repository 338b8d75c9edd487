"""A node that roslaunch starts finds ROS, PyPI's packages and ours."""

import importlib
import unittest

import rospy
from nodelet.srv import NodeletList
from std_msgs.msg import String


class Workspace(unittest.TestCase):
    def test_imports(self):
        for name in (
            "torch",
            "pybullet",
            "gazebo_msgs.srv",
            "control_msgs.msg",
            "controller_manager_msgs.srv",
            "bullet_gazebo_msgs.srv",
            "bullet_gazebo",
            "robot_sim",
            "ros_utils",
        ):
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
