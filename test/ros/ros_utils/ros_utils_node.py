#!/usr/bin/env python3
"""The client helpers against real nodes and fake services."""

import subprocess
import sys
import tempfile
import unittest
from unittest import mock

import rosgraph
import rospy
import rostest
from controller_manager_msgs.msg import ControllerState
from controller_manager_msgs.srv import ListControllers, LoadController, SwitchController
from std_srvs.srv import Empty, EmptyResponse
from support.ros.calls import BOUND, wait_until

from ros_utils import ros_controllers, ros_gazebo, ros_launch, ros_node, ros_urdf

TRANSIENT = "import rospy; rospy.init_node('stranger'); rospy.spin()"


def registered():
    state = rosgraph.Master("/test").getSystemState()
    return {node for kind in state for _, nodes in kind for node in nodes}


def load_description(ns="/"):
    return ros_urdf.urdf_load_from_pkg(
        "cartpole_gazebo", "cartpole_v1.urdf", "robot_description", folder="/robots", ns=ns
    )


class Nodes(unittest.TestCase):
    def tearDown(self):
        self.assertTrue(ros_node.ros_kill_all_processes())
        self.assertIn(rospy.get_name(), registered())

    def test_start_and_kill(self):
        self.assertTrue(load_description("/a"))
        package = "joint_state_publisher"
        self.assertTrue(ros_node.ros_node_from_pkg(package, package, name="jsp", ns="/a/"))
        self.assertIn("/a/jsp", registered())
        self.assertTrue(ros_node.ros_kill_node("/a/jsp"))
        self.assertNotIn("/a/jsp", registered())
        self.assertTrue(ros_node.ros_kill_node("/a/jsp"))

    def test_arguments_and_own_name(self):
        self.assertTrue(load_description())
        package = "robot_state_publisher"
        self.assertTrue(ros_node.ros_node_from_pkg(package, package, args="tf:=/elsewhere"))
        self.assertIn("/robot_state_publisher", registered())
        published = [topic for topic, _ in rosgraph.Master("/test").getSystemState()[0]]
        self.assertIn("/elsewhere", published)

    def test_a_node_that_fails(self):
        # Its command line is wrong, so it ends before it becomes a node.
        self.assertFalse(ros_node.ros_node_from_pkg("gazebo_ros", "spawn_model", args="-model m"))

    def test_a_second_node_of_the_same_name_counts_only_once_it_runs(self):
        self.assertTrue(load_description())
        package = "joint_state_publisher"
        self.assertTrue(ros_node.ros_node_from_pkg(package, package, name="jsp"))
        first = rosgraph.Master("/test").lookupNode("/jsp")
        self.assertTrue(ros_node.ros_node_from_pkg(package, package, name="jsp"))
        self.assertNotEqual(rosgraph.Master("/test").lookupNode("/jsp"), first)

    def test_strangers_are_asked_and_own_node_is_spared(self):
        stranger = subprocess.Popen([sys.executable, "-c", TRANSIENT])
        self.assertTrue(wait_until(lambda: "/stranger" in registered()))
        self.assertFalse(ros_node.ros_kill_node(rospy.get_name()))
        self.assertTrue(ros_node.ros_kill_all_nodes())
        self.assertEqual(stranger.wait(BOUND), 0)
        self.assertFalse(ros_node.ros_kill_master(), "the master isn't ours")

    def test_launch(self):
        self.assertTrue(load_description("/c"))
        self.assertTrue(ros_launch.ros_launch_from_path(LAUNCH, ["rate:=20"]))
        self.assertTrue({"/c/jsp", "/c/rsp"} <= registered())
        self.assertEqual(rospy.get_param("/c/jsp/rate"), 20)
        self.assertTrue(ros_launch.ros_kill_launch_process())
        self.assertTrue(wait_until(lambda: not {"/c/jsp", "/c/rsp"} & registered()))

    def test_a_launch_that_fails(self):
        with tempfile.NamedTemporaryFile("w", suffix=".launch") as file:
            file.write("<launch><node></launch>")
            file.flush()
            self.assertFalse(ros_launch.ros_launch_from_path(file.name))


class Services(unittest.TestCase):
    """Fake services stand for a simulator that misbehaves."""

    def offer(self, name, kind, handler):
        service = rospy.Service(name, kind, handler)
        self.addCleanup(service.shutdown)

    def test_a_failed_call_is_tried_again(self):
        calls = []

        def fail_twice(_request):
            calls.append(1)
            return EmptyResponse() if len(calls) == 3 else None

        self.offer("/gazebo/pause_physics", Empty, fail_twice)
        self.assertFalse(ros_gazebo.gazebo_pause_physics(retries=2))
        self.assertTrue(ros_gazebo.gazebo_pause_physics(retries=1))
        self.assertEqual(len(calls), 3)

    def test_a_missing_service(self):
        with mock.patch("rospy.logerr") as told:
            self.assertFalse(ros_gazebo.gazebo_reset_world(timeout=0.3))
        self.assertIn("within 0.3 s", str(told.call_args))

    def test_a_controller_that_cannot_be_loaded(self):
        manager = FakeManager(self)
        self.assertFalse(ros_controllers.spawn_controllers_srv(["bad", "a"], ns="/f"))
        self.assertEqual(manager.states, {"a": "running"})
        self.assertEqual(manager.loads, ["bad"] * 5 + ["a"])
        self.assertFalse(ros_controllers.load_controller_list_srv(["bad", "c"], "/f", 1))
        self.assertIn("c", manager.states)
        self.assertFalse(ros_controllers.load_controller_srv("d", "/f", max_retries=0))


class FakeManager:
    """Keeps a book about controllers; refuses to load "bad"."""

    def __init__(self, test):
        self.states, self.loads = {}, []
        test.offer("/f/controller_manager/load_controller", LoadController, self.load)
        test.offer("/f/controller_manager/switch_controller", SwitchController, self.switch)
        test.offer("/f/controller_manager/list_controllers", ListControllers, self.list)

    def load(self, request):
        self.loads.append(request.name)
        ok = request.name != "bad" and request.name not in self.states
        if ok:
            self.states[request.name] = "initialized"
        return ok

    def switch(self, request):
        self.states.update(dict.fromkeys(request.start_controllers, "running"))
        return True

    def list(self, _request):
        return [[ControllerState(name=n, state=s) for n, s in self.states.items()]]


LAUNCH_TEXT = """
<launch>
  <arg name="rate" default="10"/>
  <group ns="c">
    <node name="jsp" pkg="joint_state_publisher" type="joint_state_publisher">
      <param name="rate" value="$(arg rate)"/>
    </node>
    <node name="rsp" pkg="robot_state_publisher" type="robot_state_publisher"/>
  </group>
</launch>
"""


class Suite(unittest.TestSuite):
    def __init__(self):
        super().__init__()
        for case in (Nodes, Services):
            self.addTests(unittest.defaultTestLoader.loadTestsFromTestCase(case))


if __name__ == "__main__":
    with tempfile.NamedTemporaryFile("w", suffix=".launch") as file:
        file.write(LAUNCH_TEXT)
        file.flush()
        LAUNCH = file.name
        rospy.init_node("ros_utils_test")
        load_description()
        rostest.rosrun("cartpole", "ros_utils", "__main__.Suite")
