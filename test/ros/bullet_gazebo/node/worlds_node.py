#!/usr/bin/env python3
"""A world from a file, and SDF models spawned into it.

See docs/contract/gazebo.md 2.3 to 2.5.
"""

import math
import subprocess
import tempfile
import time
import unittest
from concurrent.futures import ThreadPoolExecutor
from functools import partial

import rospy
import rostest
from gazebo_msgs.msg import ModelStates
from support.ros.calls import BOUND, delete_model, executable, gazebo, model_names, position, spawn_model
from support.ros.world_case import WorldCase

from ros_utils import ros_gazebo

STILL = 0.2  # [s of simulated time]
EXISTS = "SpawnModel: Failure - entity already exists."
UNKNOWN = (
    "GazeboRosApiPlugin SpawnModel Failure: input model_xml not SDF or URDF, or cannot be converted "
    "to Gazebo compatible format."
)
INERTIAL = (
    "<inertial><mass>1</mass><inertia><ixx>0.01</ixx><iyy>0.01</iyy><izz>0.01</izz></inertia></inertial>"
)
BOX = (
    f'<sdf version="1.6"><model name="x">{{more}}<link name="body">{INERTIAL}<collision name="shell">'
    "<geometry><box><size>0.2 0.2 0.2</size></box></geometry></collision></link></model></sdf>"
)
ROBOT = (
    f'<sdf version="1.5"><model name="x"><link name="base">{INERTIAL}<collision name="c1"><geometry>'
    "<box><size>0.4 0.4 0.2</size></box></geometry></collision></link>"
    f'<link name="arm"><pose>0 0 0.3 0 0 0</pose>{INERTIAL}</link><joint name="shoulder" '
    'type="revolute"><parent>base</parent><child>arm</child><pose>0 0 -0.2 0 0 0</pose><axis>'
    "<xyz>0 1 0</xyz><limit><lower>-1</lower><upper>1</upper></limit></axis></joint></model></sdf>"
)
LINK = (
    '<link name="{}"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
    '</inertial><collision><geometry><sphere radius="0.1"/></geometry></collision></link>'
)
URDF = (
    f'<robot name="r">{LINK.format("a")}{LINK.format("b")}<joint name="j" type="fixed">'
    '<parent link="a"/><child link="b"/></joint></robot>'
)


spawn_sdf = partial(spawn_model, kind="sdf")


def resting_height(name):
    """Waits until `name` has stood still for a time of the simulation's; returns its origin's height [m]."""
    deadline, before = time.monotonic() + BOUND, None
    while time.monotonic() < deadline:
        found = gazebo("get_model_state", name, "")
        now, height = found.header.stamp.to_sec(), found.pose.position.z
        if before is None or now - before[0] > STILL:
            if before is not None and abs(height - before[1]) < 1e-5:
                return height
            before = now, height
        time.sleep(0.05)
    raise AssertionError(f"{name} still moves")


class WorldFile(unittest.TestCase):
    def test_models_that_can_be_read_are_there_in_order(self):
        self.assertEqual(model_names()[:4], ["ground_plane", "table", "box", "crate_one"])
        self.assertNotIn("broken", model_names())

    def test_boxes_rest_on_what_is_under_them(self):
        self.assertAlmostEqual(resting_height("box"), 0.65, delta=0.005)  # on the table
        self.assertAlmostEqual(resting_height("crate_one"), 0.2, delta=0.01)
        self.assertAlmostEqual(position("table").z, 0.0, delta=1e-6)

    def test_links_of_a_static_model_stand_where_the_file_puts_them(self):
        state = gazebo("get_link_state", "table::leg", "").link_state
        self.assertAlmostEqual(state.pose.position.z, 0.225, delta=1e-6)

    def test_it_begins_as_it_was_saved_and_a_reset_returns_to_the_models_poses(self):
        found = gazebo("get_model_state", "shelf", "")
        self.assertAlmostEqual(found.pose.position.y, -4.0, delta=1e-6)
        self.assertAlmostEqual(found.pose.orientation.z, math.sin(0.35), delta=1e-6)
        gazebo("reset_world")
        found = gazebo("get_model_state", "shelf", "")
        self.assertAlmostEqual(found.pose.position.y, -8.0, delta=1e-6)
        self.assertAlmostEqual(found.pose.orientation.z, 0.0, delta=1e-6)

    def test_an_actor_is_a_model_that_is_where_time_has_brought_it(self):
        self.assertIn("walker", model_names())
        states = rospy.wait_for_message("/gazebo/model_states", ModelStates, BOUND)
        self.assertEqual(states.pose[states.name.index("walker")].position.x, -5.0)
        found = gazebo("get_model_state", "walker", "")
        self.assertAlmostEqual(found.pose.position.y, found.header.stamp.to_sec() - 5.0, delta=1e-6)

    def test_physics_is_the_files(self):
        physics = gazebo("get_physics_properties")
        self.assertAlmostEqual(physics.gravity.z, -9.81)
        self.assertAlmostEqual(physics.time_step, 0.002)
        self.assertAlmostEqual(physics.max_update_rate, 500.0)
        self.assertEqual(physics.ode_config.sor_pgs_iters, 80)


class Spawning(WorldCase):
    def test_an_sdf_robot_has_its_names_and_stands(self):
        self.spawn("sdf_robot", ROBOT, "/arm", kind="sdf", y=5.0, z=0.2)
        found = gazebo("get_model_properties", "sdf_robot")
        self.assertEqual((found.body_names, found.geom_names), (["base", "arm"], ["c1"]))
        self.assertEqual(found.joint_names, ["shoulder"])
        self.assertAlmostEqual(resting_height("sdf_robot"), 0.1, delta=0.01)

    def test_the_files_pose_is_taken_in_the_requested_one(self):
        more = "<pose>0 0 1 0 0 0</pose><static>1</static>"
        self.spawn("high", BOX.format(more=more), kind="sdf", x=1.0, frame="table")
        self.assertAlmostEqual(position("high").x, 3.0, delta=1e-6)
        self.assertAlmostEqual(position("high").z, 1.0, delta=1e-6)

    def test_a_world_include_brings_a_model_from_the_path(self):
        include = '<sdf version="1.4"><world name="d"><include><uri>model://{}</uri></include></world></sdf>'
        self.spawn("mine", include.format("crate"), kind="sdf", y=-5.0, z=0.3)
        self.assertAlmostEqual(resting_height("mine"), 0.2, delta=0.01)
        self.spawn("floor", include.format("ground_plane"), kind="sdf", z=-1.0)
        self.assertIn("floor", model_names())

    def test_a_urdf_root_is_taken_too_and_collisions_are_named(self):
        self.spawn("urdf", URDF, kind="sdf", x=-5.0, z=1.0)
        found = gazebo("get_model_properties", "urdf")
        self.assertEqual(found.geom_names, ["a_collision", "a_fixed_joint_lump__b_collision_1"])

    def test_thousands_of_faults_are_a_few_lines(self):
        """Each would be a line in the log, and the spawn would take minutes."""
        blocks = '<gazebo reference="gone"><mu1>1</mu1></gazebo>' * 20_000
        plugins = '<gazebo><plugin filename="libnobody_has.so"/></gazebo>' * 10_000
        xml = URDF.replace("</robot>", f"{blocks}{plugins}</robot>")
        self.spawn("wordy", xml, kind="sdf", y=-30.0, z=1.0)

    def test_a_light_is_spawned_under_the_models_name(self):
        xml = '<sdf version="1.6"><light name="l" type="point"><pose>0 0 1 0 0 0</pose></light></sdf>'
        self.assertTrue(spawn_sdf("torch", xml).success)
        self.assertEqual(spawn_sdf("torch", xml).status_message, EXISTS)
        self.assertNotIn("torch", model_names())
        self.assertTrue(spawn_sdf("box", xml).success)  # a model of that name is no hindrance
        for name in ("torch", "box"):
            self.assertTrue(gazebo("delete_light", name).success)


class Refusals(unittest.TestCase):
    def refused(self, text, name, xml, **kwargs):
        before = model_names()
        answer = spawn_sdf(name, xml, **kwargs)
        self.assertFalse(answer.success)
        self.assertIn(text, answer.status_message)
        self.assertEqual(model_names(), before)

    def test_texts_of_gazebo(self):
        self.refused(EXISTS, "box", BOX.format(more=""))
        self.refused(UNKNOWN, "new", "<world/>")
        self.refused(UNKNOWN, "new", BOX[:50])
        self.refused(UNKNOWN, "new", "")
        self.refused(
            "SpawnModel: reference reference_frame not found, did you forget to scope the link by model "
            "name?", "new", BOX.format(more=""), frame="nowhere",
        )  # fmt: skip

    def test_a_sdf_is_no_urdf(self):
        with self.assertRaises(rospy.ServiceException):
            spawn_model("new", BOX.format(more=""))

    def test_traps_and_giants(self):
        bomb = '<!DOCTYPE a [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;">]><sdf>&b;</sdf>'
        self.refused("<!DOCTYPE>", "new", bomb)
        self.refused("nested more than 100 deep", "new", "<sdf>" * 100000)
        self.refused("has no mass", "new", f'<robot name="r"><link name="{"x" * 900}"/></robot>')
        self.refused("longer than 1000 bytes", "new", f'<robot name="r"><link name="{"x" * 10**7}"/></robot>')
        links = "".join(f'<link name="l{i}"/>' for i in range(400_000))
        self.refused("links", "new", f'<robot name="r">{links}</robot>')
        with self.assertRaises(rospy.ServiceException):
            spawn_model("new", "<!--" * 2_500_000)
        with self.assertRaises(rospy.ServiceException):
            spawn_model("new", "<?" * 5_000_000)


class OddFiles(unittest.TestCase):
    """Files and texts that take long, or come from elsewhere."""

    def test_spawns_of_others_go_on_while_a_file_is_read(self):
        """Seven hundred links are melted one after the other, for seconds; then a fault is found."""
        inertial = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial>'
        shapes = '<visual><geometry><box size="1 1 1"/></geometry></visual>' * 3
        ends = '<parent link="l{}"/><child link="l{}"/></joint>'
        links = "".join(f'<link name="l{i}">{inertial}{shapes}</link>' for i in range(700))
        joints = "".join(
            f'<joint name="j{i}" type="{"fixed" if i < 698 else "planar"}">' + ends.format(i, i + 1)
            for i in range(699)
        )
        served = 0
        with ThreadPoolExecutor(1) as pool:
            answer = pool.submit(spawn_sdf, "slow", f'<robot name="r">{links}{joints}</robot>')
            while not answer.done():
                self.assertTrue(spawn_sdf("quick", BOX.format(more=""), x=40.0).success)
                self.assertTrue(delete_model("quick").success)
                served += not answer.done()
        self.assertIn("a planar joint is only simulated", answer.result().status_message)
        # One may come before the slow one is looked at; if they waited, no second one would.
        self.assertGreater(served, 2)

    def test_spawn_model_reads_files_of_every_encoding(self):
        declaration = '\n<!-- mine -->\n<?xml version="1.0" encoding="{0}"?>\r\n<!-- Gelände -->'
        with tempfile.NamedTemporaryFile(suffix=".sdf") as file:
            for encoding, source in (
                ("utf-8-sig", ["-file", file.name]), ("utf-16", ["-stdin"]),
                ("latin-1", ["-file", file.name]),
            ):  # fmt: skip
                text = declaration.format(encoding.removesuffix("-sig")) + BOX.format(more="")
                with open(file.name, "wb") as written:
                    written.write(text.encode(encoding))
                command = [executable("gazebo_ros", "spawn_model"), "-sdf", "-model", "from_file"]
                with open(file.name, "rb") as piped:
                    code = subprocess.call([*command, *source, "-x", "60"], stdin=piped)
                self.assertEqual(code, 0, (encoding, source))
                self.assertTrue(delete_model("from_file").success)
                self.assertTrue(ros_gazebo.gazebo_spawn_sdf_path(file.name, "from_file", pos_x=60))
                self.assertTrue(delete_model("from_file").success)

    def test_a_description_on_the_parameter_server_may_begin_with_anything(self):
        """Also for the control plugin, which reads it there by itself."""
        transmission = (
            '<transmission name="t"><type>transmission_interface/SimpleTransmission</type><joint name="j">'
            "<hardwareInterface>hardware_interface/EffortJointInterface</hardwareInterface></joint>"
            '<actuator name="m"/></transmission>'
            '<gazebo><plugin filename="libgazebo_ros_control.so" name="c"/></gazebo></robot>'
        )
        text = URDF.replace('type="fixed"', 'type="continuous"').replace("</robot>", transmission)
        xml = f'\ufeff\r\n<!-- mine -->\r\n<?xml version="1.0" encoding="ISO-8859-1"?>\r\n{text}'
        rospy.set_param("/odd/robot_description", xml)
        command = [executable("gazebo_ros", "spawn_model"), "-urdf", "-model", "odd", "-x", "70",
                   "-param", "/odd/robot_description", "-robot_namespace", "/odd"]  # fmt: skip
        self.assertEqual(subprocess.call(command), 0)
        rospy.wait_for_service("/odd/controller_manager/list_controllers", BOUND)
        self.assertTrue(ros_gazebo.gazebo_spawn_sdf_param("robot_description", "odd2", "/odd", pos_x=80))
        for name in ("odd", "odd2"):
            self.assertTrue(delete_model(name).success)


if __name__ == "__main__":
    rospy.init_node("worlds_test")
    rostest.rosrun("cartpole", "worlds", "__main__")
