#!/usr/bin/env python3
"""Gazebo's services and topics as a client sees them (docs/contract/gazebo.md 1 and 2)."""

import threading
import unittest
from itertools import pairwise

import rospy
import rostest
from gazebo_msgs.msg import ModelStates
from gazebo_msgs.srv import (
    DeleteModel,
    GetJointProperties,
    GetModelState,
    GetWorldProperties,
    SetModelConfiguration,
    SpawnModel,
    SpawnModelRequest,
)
from geometry_msgs.msg import Point, Pose
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from std_srvs.srv import Empty
from support.ros.calls import BOUND, call, sim_time, wait_until
from support.ros.manager import Manager
from support.ros.subscribed import Listener

CONTROLLERS = ["joint_state_controller", "stand_cart_position_controller"]


def spawn(name="cartpole", xml=None, **kwargs):
    xml = rospy.get_param("/robot_description") if xml is None else xml
    fields = {"robot_namespace": "/"} | kwargs
    request = SpawnModelRequest(model_name=name, model_xml=xml, **fields)
    return call("/gazebo/spawn_urdf_model", SpawnModel, request)


def place(cart, pole):
    return call("/gazebo/set_model_configuration", SetModelConfiguration, "cartpole",
                "robot_description", ["stand_cart", "cart_pole"], [cart, pole])  # fmt: skip


def models():
    return call("/gazebo/get_world_properties", GetWorldProperties).model_names


def joint(name):
    return call("/gazebo/get_joint_properties", GetJointProperties, name)


class StandInTest(unittest.TestCase):
    def setUp(self):
        call("/gazebo/pause_physics", Empty)
        self.assertTrue(spawn().success)

    def tearDown(self):
        call("/gazebo/pause_physics", Empty)
        for name in ("cartpole", "second"):
            call("/gazebo/delete_model", DeleteModel, name)

    def listen(self, topic, kind):
        listener = Listener(topic, kind)
        self.addCleanup(listener.close)
        return listener

    def start_controllers(self):
        self.assertTrue(Manager().start(*CONTROLLERS))

    # the world

    def test_world_properties(self):
        world = call("/gazebo/get_world_properties", GetWorldProperties)
        self.assertEqual(world.model_names, ["ground_plane", "cartpole"])
        self.assertTrue(world.success)
        self.assertFalse(world.rendering_enabled, "there are no cameras (docs/differences.md)")
        self.assertEqual(world.status_message, "GetWorldProperties: got properties")

    def test_joint_properties(self):
        place(0.1, 0.2)
        found = joint("cartpole::cart_pole")
        self.assertEqual((found.type, list(found.damping)), (0, []))
        self.assertEqual((list(found.position), list(found.rate)), ([0.2], [0.0]))
        self.assertEqual(found.status_message, "GetJointProperties: got properties")
        self.assertEqual(joint("elbow").status_message, "GetJointProperties: joint not found")

    def test_model_configuration(self):
        self.assertEqual(place(0.7, 0.1).status_message, "SetModelConfiguration: success")
        self.assertEqual(list(joint("stand_cart").position), [0.5])  # clamped
        service = "/gazebo/set_model_configuration"
        answer = call(service, SetModelConfiguration, "nobody", "", [], [])
        self.assertEqual(answer.status_message, "SetModelConfiguration: model does not exist")
        answer = call(service, SetModelConfiguration, "cartpole", "", ["cart_pole"], [])
        self.assertEqual(
            answer.status_message,
            "SetModelConfiguration: joint name and position list have different lengths",
        )
        answer = call(service, SetModelConfiguration, "cartpole", "", ["elbow"], [1.0])
        self.assertTrue(answer.success)
        answer = call(service, SetModelConfiguration, "cartpole", "", ["cart_pole"], [float("nan")])
        self.assertFalse(answer.success)
        self.assertEqual(list(joint("cart_pole").position), [0.1])

    # spawning

    def test_spawn_refuses_what_it_cannot_read(self):
        for xml, text in (
            ("<sdf/>", "entity format is invalid"),
            ("no xml", "entity format is invalid"),
            ('<robot><link name="a"/><mesh filename="package://no_such_pkg/m.stl"/></robot>',
             "urdf reference package name does not exist: no_such_pkg"),
        ):  # fmt: skip
            with self.assertRaisesRegex(rospy.ServiceException, text):
                spawn("other", xml)
        answer = spawn("other", '<robot><joint name="j" type="revolute"/></robot>')
        self.assertFalse(answer.success)
        self.assertIn("joint 'j'", answer.status_message)
        self.assertEqual(models(), ["ground_plane", "cartpole"])

    def test_spawning_and_deleting_at_once_keeps_the_world_alive(self):
        ends = threading.Event()

        def delete():
            while not ends.is_set():
                call("/gazebo/delete_model", DeleteModel, "second")

        call("/gazebo/delete_model", DeleteModel, "cartpole")
        call("/gazebo/unpause_physics", Empty)
        threads = [threading.Thread(target=delete) for _ in range(2)]
        for thread in threads:
            thread.start()
        for _ in range(15):
            spawn("second")
        ends.set()
        for thread in threads:
            thread.join(BOUND)
        before = sim_time()
        self.assertTrue(wait_until(lambda: sim_time() > before))

    def test_a_namespace_or_name_that_ros_refuses_is_refused_here(self):
        self.assertTrue(spawn("second", robot_namespace="/bad ns").success)
        self.assertEqual(Manager().states(), {})  # the first robot's manager, untouched
        self.assertFalse(Manager().load("bad name"))

    def test_a_pose_out_of_this_world_is_refused(self):
        answer = spawn("second", initial_pose=Pose(position=Point(1e300, 0.0, 0.0)))
        self.assertFalse(answer.success)
        self.assertIn("beyond 1e+06 m", answer.status_message)

    def test_a_second_robot_in_the_same_namespace_stands_without_control(self):
        self.start_controllers()
        self.assertTrue(spawn("second").success)
        self.assertEqual(models(), ["ground_plane", "cartpole", "second"])
        self.assertTrue(call("/gazebo/delete_model", DeleteModel, "second").success)
        self.assertEqual(Manager().states(), dict.fromkeys(CONTROLLERS, "running"))

    def test_spawn_frames(self):
        pose = Pose(position=Point(0.0, 1.0, 0.0))
        answer = spawn("second", initial_pose=pose, reference_frame="cartpole::cart")
        self.assertTrue(answer.success, answer.status_message)
        state = call("/gazebo/get_model_state", GetModelState, "second", "world")
        self.assertAlmostEqual(state.pose.position.y, 1.0, places=6)
        self.assertAlmostEqual(state.pose.position.z, 0.15, places=6)
        call("/gazebo/delete_model", DeleteModel, "second")
        answer = spawn("second", initial_pose=pose, reference_frame="nowhere")
        self.assertFalse(answer.success)
        self.assertIn("reference_frame not found", answer.status_message)

    def test_delete_takes_the_controller_manager_along(self):
        rospy.wait_for_service("/controller_manager/list_controllers", BOUND)
        answer = call("/gazebo/delete_model", DeleteModel, "cartpole")
        self.assertEqual(answer.status_message, "DeleteModel: successfully deleted model")
        with self.assertRaises(rospy.ROSException):
            rospy.wait_for_service("/controller_manager/list_controllers", 0.2)
        answer = call("/gazebo/delete_model", DeleteModel, "cartpole")
        self.assertEqual(answer.status_message, "DeleteModel: model does not exist")

    # time

    def test_nothing_is_published_while_paused_and_clock_moves_on_unpause(self):
        clock = self.listen("/clock", Clock)
        models = self.listen("/gazebo/model_states", ModelStates)
        before = sim_time()
        self.assertFalse(clock.wait_for(len, bound=0.3))
        self.assertEqual(models.messages, [])
        call("/gazebo/unpause_physics", Empty)
        self.assertTrue(clock.wait_for(lambda m: len(m) >= 50))
        self.assertTrue(models.wait_for(lambda m: len(m) >= 50))
        call("/gazebo/pause_physics", Empty)
        self.assertEqual(models.messages[-1].name, ["ground_plane", "cartpole"])
        # One message a tick; a busy host may lose some to the queue's bound, as with Gazebo: the first, too.
        stamps = [round(before * 1e9), *(m.clock.to_nsec() for m in clock.messages)]
        gaps = [b - a for a, b in pairwise(stamps)]
        self.assertEqual(min(gaps), 1_000_000)
        self.assertTrue(all(gap % 1_000_000 == 0 for gap in gaps), gaps)

    # control

    def test_controllers_start_while_paused_and_hold_then_follow(self):
        self.start_controllers()
        self.assertEqual(Manager().states(), dict.fromkeys(CONTROLLERS, "running"))
        states = self.listen("/joint_states", JointState)
        call("/gazebo/unpause_physics", Empty)
        self.assertTrue(states.wait_for(len))
        self.assertEqual(states.messages[0].name, ["cart_pole", "stand_cart"])
        self.assertEqual(len(states.messages[0].effort), 2)
        command = rospy.Publisher("/stand_cart_position_controller/command", Float64, queue_size=1)
        self.assertTrue(wait_until(command.get_num_connections))
        command.publish(0.1)
        self.assertTrue(states.wait_for(lambda m: m[-1].position[1] > 0.09))

    def test_a_service_that_moves_joints_reports_them_at_once_while_paused(self):
        self.start_controllers()
        states = self.listen("/joint_states", JointState)
        place(0.1, 0.05)
        self.assertTrue(states.wait_for(lambda m: m and m[-1].position == (0.05, 0.1)))
        self.assertEqual(states.messages[-1].velocity, (0.0, 0.0))


if __name__ == "__main__":
    rospy.init_node("stand_in_test")
    rostest.rosrun("cartpole", "stand_in", StandInTest)
