"""Gazebo's services and topics as a client sees them (docs/contract/gazebo.md 1 and 2)."""

import threading
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

import rospy
from gazebo_msgs.msg import ModelStates
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from support.ros.calls import (
    BOUND,
    delete_model,
    gazebo,
    joint,
    model_names,
    position,
    sim_time,
    spawn_model,
    time_passes,
)
from support.ros.manager import Manager
from support.ros.world_case import WorldCase

CONTROLLERS = ["joint_state_controller", "stand_cart_position_controller"]


def place(cart, pole):
    return gazebo("set_model_configuration", "cartpole", "robot_description",
                  ["stand_cart", "cart_pole"], [cart, pole])  # fmt: skip


class StandInTest(WorldCase):
    def setUp(self):
        gazebo("pause_physics")
        self.xml = rospy.get_param("/robot_description")
        self.spawn("cartpole", self.xml)

    def start_controllers(self):
        self.assertTrue(Manager().start(*CONTROLLERS))

    # the world

    def test_world_properties(self):
        world = gazebo("get_world_properties")
        self.assertEqual(world.model_names, ["ground_plane", "cartpole"])
        self.assertTrue(world.success)
        self.assertFalse(world.rendering_enabled, "there are no cameras (docs/gazebo.md)")
        self.assertEqual(world.status_message, "GetWorldProperties: got properties")

    def test_joint_properties(self):
        place(0.1, 0.2)
        found = gazebo("get_joint_properties", "cartpole::cart_pole")
        self.assertEqual((found.type, list(found.damping)), (0, []))
        self.assertEqual((list(found.position), list(found.rate)), ([0.2], [0.0]))
        self.assertEqual(found.status_message, "GetJointProperties: got properties")
        found = gazebo("get_joint_properties", "elbow")
        self.assertEqual(found.status_message, "GetJointProperties: joint not found")

    def test_model_configuration(self):
        self.assertEqual(place(0.7, 0.1).status_message, "SetModelConfiguration: success")
        self.assertEqual(joint("stand_cart")[0], 0.5)  # clamped
        lengths = "SetModelConfiguration: joint name and position list have different lengths"
        for name, joints, positions, success, text in (
            ("nobody", [], [], False, "SetModelConfiguration: model does not exist"),
            ("cartpole", ["cart_pole"], [], False, lengths),
            ("cartpole", ["elbow"], [1.0], True, ""),
            ("cartpole", ["cart_pole"], [float("nan")], False, ""),
        ):
            answer = gazebo("set_model_configuration", name, "", joints, positions)
            self.assertEqual(answer.success, success)
            self.assertIn(text, answer.status_message)
        self.assertEqual(joint("cart_pole")[0], 0.1)

    # spawning

    def test_spawn_refuses_what_it_cannot_read(self):
        for xml, text in (
            ("<sdf/>", "entity format is invalid"),
            ("no xml", "entity format is invalid"),
            ('<robot><link name="a"/><mesh filename="package://no_such_pkg/m.stl"/></robot>',
             "urdf reference package name does not exist: no_such_pkg"),
        ):  # fmt: skip
            with self.assertRaisesRegex(rospy.ServiceException, text):
                spawn_model("other", xml)
        answer = spawn_model("other", '<robot><joint name="j" type="revolute"/></robot>')
        self.assertFalse(answer.success)
        self.assertIn("joint 'j'", answer.status_message)
        self.assertEqual(model_names(), ["ground_plane", "cartpole"])

    def test_spawning_and_deleting_at_once_keeps_the_world_alive(self):
        def delete(_):
            while not ends.is_set():
                delete_model("second")

        ends = threading.Event()
        delete_model("cartpole")
        gazebo("unpause_physics")
        with ThreadPoolExecutor(2) as pool:
            deleting = pool.map(delete, range(2))
            for _ in range(15):
                spawn_model("second", self.xml)
            ends.set()
            list(deleting)
        self.addCleanup(delete_model, "second")
        self.assertTrue(time_passes())

    def test_a_namespace_or_name_that_ros_refuses_is_refused_here(self):
        self.spawn("second", self.xml, "/bad ns")
        self.assertEqual(Manager().states(), {})  # the first robot's manager, untouched
        self.assertFalse(Manager().load("bad name"))

    def test_a_second_robot_in_the_same_namespace_stands_without_control(self):
        self.start_controllers()
        self.spawn("second", self.xml)
        self.assertEqual(model_names(), ["ground_plane", "cartpole", "second"])
        self.assertTrue(delete_model("second").success)
        self.assertEqual(Manager().states(), dict.fromkeys(CONTROLLERS, "running"))

    def test_spawns_are_placed_in_a_frame_and_within_bounds(self):
        self.spawn("second", self.xml, y=1.0, frame="cartpole::cart")
        place = position("second", "world")
        self.assertAlmostEqual(place.y, 1.0, places=6)
        self.assertAlmostEqual(place.z, 0.15, places=6)
        for wrong, text in (
            ({"frame": "nowhere"}, "reference_frame not found"),
            ({"x": 1e300}, "beyond 1e+06 m"),
        ):
            answer = spawn_model("third", self.xml, **wrong)
            self.assertFalse(answer.success)
            self.assertIn(text, answer.status_message)

    def test_delete_takes_the_controller_manager_along(self):
        rospy.wait_for_service("/controller_manager/list_controllers", BOUND)
        answer = delete_model("cartpole")
        self.assertEqual(answer.status_message, "DeleteModel: successfully deleted model")
        with self.assertRaises(rospy.ROSException):
            rospy.wait_for_service("/controller_manager/list_controllers", 0.2)
        answer = delete_model("cartpole")
        self.assertEqual(answer.status_message, "DeleteModel: model does not exist")

    # time

    def test_nothing_is_published_while_paused_and_clock_moves_on_unpause(self):
        clock = self.hear("/clock", Clock)
        models = self.hear("/gazebo/model_states", ModelStates)
        before = sim_time()
        self.assertFalse(clock.wait_for(len, bound=0.3))
        self.assertEqual(models.messages, [])
        gazebo("unpause_physics")
        self.assertTrue(clock.wait_for(lambda m: len(m) >= 50))
        self.assertTrue(models.wait_for(lambda m: len(m) >= 50))
        gazebo("pause_physics")
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
        states = self.hear("/joint_states", JointState)
        gazebo("unpause_physics")
        self.assertTrue(states.wait_for(len))
        self.assertEqual(states.messages[0].name, ["cart_pole", "stand_cart"])
        self.assertEqual(len(states.messages[0].effort), 2)
        self.publisher("/stand_cart_position_controller/command", Float64).publish(0.1)
        self.assertTrue(states.wait_for(lambda m: m[-1].position[1] > 0.09))

    def test_a_service_that_moves_joints_reports_them_at_once_while_paused(self):
        self.start_controllers()
        states = self.hear("/joint_states", JointState)
        place(0.1, 0.05)
        self.assertTrue(states.wait_for(lambda m: m and m[-1].position == (0.05, 0.1)))
        self.assertEqual(states.messages[-1].velocity, (0.0, 0.0))
