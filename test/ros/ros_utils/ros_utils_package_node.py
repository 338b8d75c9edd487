#!/usr/bin/env python3
"""ros_utils with a user's package, whose files it finds in the usual folders."""

import os
import subprocess
import tempfile
import unittest
from pathlib import Path

import rospy
import rostest

from ros_utils import ros_controllers, ros_gazebo, ros_launch, ros_node, ros_params, ros_spawn, ros_urdf
from ros_utils.simulation import Simulation

PACKAGE = """<package format="2"><name>my_robot</name><version>0.0.1</version>
<description>A robot.</description><maintainer email="a@example.com">a</maintainer>
<license>BSD</license></package>"""
XACRO = """<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">
<xacro:arg name="mass" default="1"/>
<xacro:macro name="body" params="name"><link name="${name}"><inertial><mass value="$(arg mass)"/>
<inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link></xacro:macro>
<link name="world"/><joint name="fix" type="fixed"><parent link="world"/><child link="base"/></joint>
<xacro:body name="base"/><xacro:body name="arm"/>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/>
<limit lower="-2" upper="2" effort="10" velocity="5"/></joint>
<transmission name="t"><type>transmission_interface/SimpleTransmission</type><joint name="shoulder">
<hardwareInterface>hardware_interface/EffortJointInterface</hardwareInterface></joint>
<actuator name="m"/></transmission>
<gazebo><plugin name="c" filename="libgazebo_ros_control.so"/></gazebo></robot>"""
BOX = """<model name="x"><static>true</static><link name="box"><collision name="shell">
<geometry><box><size>1 1 1</size></box></geometry></collision></link></model>"""
SDF = f'<sdf version="1.6">{BOX}</sdf>'
WORLD = f"""<sdf version="1.6"><world name="default"><gravity>0 0 -1.5</gravity>
<include><uri>model://ground_plane</uri></include>{BOX}</world></sdf>"""
YAML = """
states: {type: joint_state_controller/JointStateController, publish_rate: 50}
shoulder: {type: effort_controllers/JointPositionController, joint: shoulder,
           pid: {p: 10.0, i: 0.0, d: 1.0}}
"""
LAUNCH = """<launch><arg name="number" default="1"/>
<param name="number_of_launch" value="$(arg number)"/>
<node name="relay" pkg="topic_tools" type="relay" args="a b"/></launch>"""
FILES = {
    "package.xml": PACKAGE, "urdf/robot.xacro": XACRO, "sdf/box.sdf": SDF, "config/control.yaml": YAML,
    "worlds/light.world": WORLD, "launch/relay.launch": LAUNCH,
}  # fmt: skip
CONTROLLERS = ["states", "shoulder"]


class Package(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = Path(folder.name, "my_robot")
        for name, text in FILES.items():
            path = cls.folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
        os.environ["ROS_PACKAGE_PATH"] = f"{folder.name}:{os.environ['ROS_PACKAGE_PATH']}"
        cls.simulation = Simulation(paused=True, custom_world_pkg="my_robot", custom_world_name="light.world")
        cls.addClassCleanup(cls.simulation.close)

    def setUp(self):
        self.enterContext(self.simulation.active())

    def path(self, name):
        return str(self.folder / name)

    def parameter(self, name):
        return self.run_in_simulation("rosparam", "get", name).strip()

    def run_in_simulation(self, *command):
        environment = self.simulation.environment()
        return subprocess.run(
            command, env=environment, check=True, capture_output=True, text=True, timeout=120
        ).stdout

    def test_the_packages_world(self):
        self.assertIn("x", ros_gazebo.gazebo_get_model_names())
        self.assertEqual(ros_gazebo.gazebo_get_gravity().z, -1.5)

    def test_urdf(self):
        expanded = ros_urdf.urdf_parse_from_pkg("my_robot", "robot.xacro", args_xacro=["mass:=7"])
        self.assertIn('<mass value="7"/>', expanded)
        path = self.path("urdf/robot.xacro")
        self.assertEqual(expanded, ros_urdf.urdf_parse_from_path(path, ["mass:=7"]))
        for number, ns in enumerate((None, "/", "/deep/space")):
            name = f"urdf_{number}"
            self.assertTrue(ros_urdf.urdf_load_from_pkg("my_robot", "robot.xacro", name, ns=ns))
            self.assertIn("<robot", self.parameter(f"{(ns or '').rstrip('/')}/{name}"))
        self.assertTrue(ros_urdf.urdf_load_from_path(path, "again", "/deep", ["mass:=7"]))
        self.assertIn("7", self.parameter("/deep/again"))

    def test_yaml(self):
        self.assertTrue(ros_params.ros_load_yaml_from_path(self.path("config/control.yaml"), "/y"))
        self.assertEqual(self.parameter("/y/states/publish_rate"), "50")

    def test_every_way_to_spawn(self):
        self.assertTrue(ros_urdf.urdf_load_from_pkg("my_robot", "robot.xacro", "text", ns="/p"))
        self.run_in_simulation("rosparam", "set", "/q/box", SDF)
        xml = ros_urdf.urdf_parse_from_pkg("my_robot", "robot.xacro")
        urdf, sdf = self.path("urdf/robot.xacro"), self.path("sdf/box.sdf")
        pose = {"pos_x": 2.0, "ori_z": 1.0, "ori_w": 0.0, "reference_frame": "x"}
        for name, spawned in {
            "a": ros_gazebo.gazebo_spawn_urdf_path(urdf, "a", "/a", **pose)[0],
            "b": ros_gazebo.gazebo_spawn_urdf_pkg("my_robot", "robot.xacro", "/urdf", "b", "/b", **pose)[0],
            "c": ros_gazebo.gazebo_spawn_urdf_string(xml, "c", "/c", verify=True, **pose)[0],
            "d": ros_gazebo.gazebo_spawn_urdf_param("text", "d", "/p", **pose)[0],
            "e": ros_gazebo.gazebo_spawn_sdf_path(sdf, "e", **pose),
            "f": ros_gazebo.gazebo_spawn_sdf_pkg("my_robot", "box.sdf", model_name="f", **pose),
            "g": ros_gazebo.gazebo_spawn_sdf_string(SDF, "g", verify=True, **pose),
            "h": ros_gazebo.gazebo_spawn_sdf_param("box", "h", "/q", **pose),
        }.items():
            with self.subTest(name):
                self.assertIs(spawned, True)
                _, at, _, found = ros_gazebo.gazebo_get_model_state(name, "x")
                self.assertTrue(found, ros_gazebo.gazebo_get_model_names())
                self.assertEqual((at.position.x, abs(at.orientation.z)), (2.0, 1.0))
                self.assertTrue(ros_gazebo.gazebo_delete_model(name, verify=True))

    def test_a_robot_in_a_namespace_and_its_controllers(self):
        for ns in ("/one", "/two"):
            files = ("my_robot", "robot.xacro", "control.yaml")
            options = {"gazebo_name": ns[1:], "max_pub_freq": 20, "pos_y": 3.0}
            spawned = ros_spawn.spawn_model_in_gazebo(*files, CONTROLLERS, ns=ns, **options)
            self.assertTrue(spawned)
        for ns in ("/one", "/two/"):
            states = ros_controllers.list_controllers_srv(ns)
            self.assertEqual(states, dict.fromkeys(CONTROLLERS, "running"))
        self.steer_controllers("/one")
        self.assertEqual(ros_gazebo.gazebo_get_model_state("two")[1].position.y, 3.0)
        for name in ("one", "two"):
            self.assertTrue(ros_node.ros_kill_node(f"/{name}/rob_st_pub"))
            self.assertTrue(ros_gazebo.gazebo_delete_model(name))

    def steer_controllers(self, ns):
        def states():
            return ros_controllers.list_controllers_srv(ns)

        self.assertTrue(ros_controllers.stop_controllers_srv(["shoulder"], ns))
        self.assertEqual(states(), {"states": "running", "shoulder": "stopped"})
        self.assertTrue(ros_controllers.start_controllers_srv(["shoulder"], ns, 2))
        self.assertTrue(ros_controllers.switch_controllers_srv([], CONTROLLERS, ns))
        self.assertEqual(states(), dict.fromkeys(CONTROLLERS, "stopped"))
        self.assertFalse(ros_controllers.start_controllers_srv(["nix"], ns, 2))
        self.assertTrue(ros_controllers.unload_controller_srv("shoulder", ns))
        gone = ros_controllers.unload_controller_list_srv(CONTROLLERS, ns, 1)
        self.assertEqual((bool(gone), gone.failed, states()), (False, ["shoulder"], {}))
        self.assertTrue(ros_controllers.load_controller_list_srv(CONTROLLERS, ns))
        self.assertFalse(ros_controllers.load_controller_srv("states", ns, 1), "loaded already")
        self.assertTrue(ros_controllers.spawn_controllers_srv(CONTROLLERS, ns))
        self.assertTrue(ros_controllers.reset_controllers_srv(CONTROLLERS, 3, ns))
        self.assertEqual(states(), dict.fromkeys(CONTROLLERS, "running"))

    def test_the_packages_launch_file(self):
        launch = ros_launch.ros_launch_from_pkg("my_robot", "relay.launch", ["number:=5"])
        self.assertTrue(launch)
        self.assertEqual(self.parameter("/number_of_launch"), "5")
        self.assertTrue(launch.close())


if __name__ == "__main__":
    rospy.init_node("ros_utils_package_test")
    rostest.rosrun("cartpole", "ros_utils_package", Package)
