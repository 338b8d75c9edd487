#!/usr/bin/env python3
"""Package gazebo_ros with a user's robot and launch file: spawn_model, gz, gazebo."""

import os
import signal
import subprocess
import tempfile
import time
import unittest
import xmlrpc.client
from pathlib import Path

import rosgraph
import rosnode
import rospy
import rostest
from gazebo_msgs.srv import GetWorldProperties
from gazebo_ros import gazebo_interface
from geometry_msgs.msg import Pose
from sensor_msgs.msg import JointState
from support.ros.calls import (
    BOUND,
    call,
    executable,
    gazebo,
    joint,
    model_names,
    position,
    sim_time,
    time_passes,
    wait_until,
)
from support.ros.manager import Manager

PACKAGE = """<package format="2"><name>my_arm</name><version>0.0.1</version>
<description>An arm.</description><maintainer email="a@example.com">a</maintainer>
<license>BSD</license></package>"""
INERTIAL = (
    '<inertial><mass value="1"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial>'
)
URDF = f"""<?xml version="1.0"?>
<!-- a comment -->
<robot name="arm">
  <link name="base">{INERTIAL}</link>
  <link name="lower">{INERTIAL}</link>
  <link name="upper">{INERTIAL}</link>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="lower"/>
    <axis xyz="0 0 1"/><limit lower="-2" upper="2" effort="10" velocity="5"/></joint>
  <joint name="elbow" type="revolute"><parent link="lower"/><child link="upper"/>
    <origin xyz="0.5 0 0"/><axis xyz="0 0 1"/><limit lower="-2" upper="2" effort="10" velocity="5"/>
  </joint>
  <transmission name="t"><type>transmission_interface/SimpleTransmission</type>
    <joint name="elbow"><hardwareInterface>hardware_interface/EffortJointInterface</hardwareInterface>
    </joint><actuator name="m"/></transmission>
  <gazebo><plugin name="c" filename="libgazebo_ros_control.so"/></gazebo>
  <gazebo><plugin name="j" filename="libgazebo_ros_joint_state_publisher.so">
    <robotNamespace>/listed</robotNamespace><jointName>elbow, shoulder</jointName>
    <updateRate>50</updateRate></plugin></gazebo>
  <gazebo><plugin name="u" filename="libmine.so"><robotNamespace>/mine</robotNamespace></plugin>
  </gazebo>
  <gazebo><plugin name="b" filename="libbroken.so"/></gazebo>
  <gazebo><plugin name="x" filename="libnobody_has.so"/></gazebo>
</robot>
"""
YAML = """
states: {type: joint_state_controller/JointStateController, publish_rate: 100}
elbow_position: {type: effort_controllers/JointPositionController, joint: elbow,
                 pid: {p: 10.0, i: 0.0, d: 1.0}}
"""
LAUNCH = """<launch>
  <rosparam ns="gazebo">plugins: {libmine.so: "my_plugins:Counter", libbroken.so: "my_plugins:Broken"}
  </rosparam>
  <include file="$(find gazebo_ros)/launch/empty_world.launch">
    <arg name="gui" value="false"/><arg name="physics" value="ode"/>
    <arg name="extra_gazebo_args" value="-o --seed 3 -s libx.so --verbose"/>
  </include>
  <param name="robot_description" textfile="$(find my_arm)/urdf/arm.urdf"/>
  <rosparam command="load" file="$(find my_arm)/config/control.yaml"/>
  <node name="spawn_arm" pkg="gazebo_ros" type="spawn_model"
        args="-urdf -param robot_description -model arm -z 0.5 -J elbow 0.25"/>
  <node name="controller_spawner" pkg="controller_manager" type="spawner"
        args="states elbow_position"/>
</launch>"""
BODY = "<inertial><mass>1</mass><inertia><ixx>0.1</ixx><iyy>0.1</iyy><izz>0.1</izz></inertia></inertial>"
SDF = f"""<sdf version="1.6"><model name="arm"><pose>0 0 2 0 0 0</pose>
<link name="base">{BODY}</link><link name="upper"><pose>0 0 0.5 0 0 0</pose>{BODY}</link>
<joint name="elbow" type="revolute"><parent>base</parent><child>upper</child><axis><xyz>0 0 1</xyz>
<limit><lower>-2</lower><upper>2</upper></limit></axis></joint>
<plugin name="c" filename="libgazebo_ros_control.so"/></model></sdf>"""
CRATE = """<sdf version="1.6"><model name="any"><static>true</static><link name="box"><collision name="c">
<geometry><box><size>1 1 1</size></box></geometry></collision></link></model></sdf>"""
CONFIG = "<model><name>crate</name><sdf version='1.6'>model.sdf</sdf></model>"
PLUGINS = """
import sys
import rospy
from std_msgs.msg import Int32

class Counter:
    def __init__(self, context):
        self._topic = rospy.Publisher(f"{context.namespace}/count", Int32, queue_size=1, latch=True)
        self._count = 0
        context.on_update(self.update)

    def update(self, now):
        if abs(rospy.get_time() - 1e-9 * now) > 0.02:  # /clock comes at 100 Hz
            raise RuntimeError("rospy's time is not the simulation's")
        self._count += 1
        self._topic.publish(self._count)
        if self._count == 50:
            sys.exit("enough")

    def shutdown(self):
        self._topic.unregister()

def Broken(context):
    sys.exit("broken on purpose")
"""


def write_package(folder):
    files = {"package.xml": PACKAGE, "urdf/arm.urdf": URDF, "config/control.yaml": YAML,
             "launch/arm.launch": LAUNCH, "python/my_plugins.py": PLUGINS, "sdf/arm.sdf": SDF,
             "models/crate/model.sdf": CRATE, "models/crate/model.config": CONFIG}  # fmt: skip
    for name, text in files.items():
        path = Path(folder, "my_arm", name)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)


class GazeboRos(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        write_package(cls.folder.name)
        extra = {"ROS_PACKAGE_PATH": cls.folder.name,
                 "GAZEBO_MODEL_PATH": f"{cls.folder.name}/my_arm/models",
                 "PYTHONPATH": f"{cls.folder.name}/my_arm/python"}  # fmt: skip
        cls.environment = os.environ | {
            name: f"{value}:{os.environ.get(name, '')}" for name, value in extra.items()
        }
        cls.launch = cls.start("roslaunch", "my_arm", "arm.launch")

    @classmethod
    def tearDownClass(cls):
        cls.launch.send_signal(signal.SIGINT)
        cls.launch.wait(BOUND)
        cls.folder.cleanup()

    @classmethod
    def start(cls, *command, **kwargs):
        return subprocess.Popen(command, env=cls.environment, **kwargs)

    def run_command(self, *command, code=0, text=""):
        result = subprocess.run(
            command, check=False, env=self.environment, input=text, text=True,
            capture_output=True, timeout=BOUND,
        )  # fmt: skip
        self.assertEqual(result.returncode, code, result.stdout + result.stderr)
        return result.stdout + result.stderr

    def spawn(self, *arguments, **kwargs):
        return self.run_command(executable("gazebo_ros", "spawn_model"), *arguments, **kwargs)

    def test_1_a_users_launch_file(self):
        self.assertTrue(wait_until(lambda: "arm" in model_names()))
        state = rospy.wait_for_message("/joint_states", JointState, BOUND)
        self.assertEqual(state.name, ["elbow"])
        self.assertTrue(wait_until(lambda: abs(joint("arm::elbow")[0] - 0.25) < 0.2))

    def test_2_joint_state_publisher(self):
        heard = []
        listener = rospy.Subscriber("/listed/joint_states", JointState, heard.append)
        self.assertTrue(wait_until(lambda: len(heard) > 20))
        self.assertEqual(heard[-1].name, ["elbow", "shoulder"])
        steps = {
            round((b.header.stamp - a.header.stamp).to_sec(), 4)
            for a, b in zip(heard, heard[1:], strict=False)
        }
        self.assertEqual(steps, {0.02})
        gazebo("pause_physics")
        stopped = sim_time()
        time.sleep(0.3)
        stamps = [message.header.stamp.to_sec() for message in heard]
        self.assertEqual(len(set(stamps)), len(stamps))
        self.assertLessEqual(max(stamps), stopped, "time stands still")
        heard.clear()
        gazebo("reset_simulation")
        gazebo("unpause_physics")
        self.assertTrue(
            wait_until(lambda: any(message.header.stamp.to_sec() < 0.1 for message in list(heard)))
        )
        listener.unregister()

    def test_3_plugins_of_a_user(self):
        from std_msgs.msg import Int32

        self.assertEqual(rospy.wait_for_message("/mine/count", Int32, BOUND).data, 50)
        self.assertTrue(time_passes())

    def test_4_spawn_model(self):
        path = f"{self.folder.name}/my_arm/urdf/arm.urdf"
        pose = ("-x", "-1e-1", "-Y", "1.5708", "-reference_frame", "arm")
        self.spawn("-urdf", "-file", path, "-model", "a", "-robot_namespace", "/a", *pose)
        turned = gazebo("get_model_state", "a", "arm").pose
        self.assertAlmostEqual(turned.orientation.z, 0.7071, places=2)
        self.spawn("-urdf", "-stdin", "-model", "b", "-robot_namespace", "/b", "-wait", "a", text=URDF)
        self.assertIn("b", model_names())
        self.assertIn("already exists", self.spawn("-urdf", "-file", path, "-model", "b", code=1))
        self.assertIn("not set", self.spawn("-urdf", "-param", "nix", "-model", "c", code=1))
        self.assertIn("can't be read", self.spawn("-urdf", "-file", "/nix", "-model", "c", code=1))
        self.spawn("-urdf", "-stdin", "-model", "c", text="<robot", code=1)
        gazebo("pause_physics")
        self.spawn("-urdf", "-file", path, "-model", "d", "-robot_namespace", "/d", "-wait", "a",
                   "-unpause", "-package_to_model")  # fmt: skip
        self.assertTrue(time_passes())

    def test_4_spawn_model_from_sdf(self):
        rospy.set_param("/sdf_arm/robot_description", URDF)
        states = {"type": "joint_state_controller/JointStateController", "publish_rate": 50}
        rospy.set_param("/sdf_arm/states", states)
        self.spawn("-sdf", "-file", f"{self.folder.name}/my_arm/sdf/arm.sdf", "-model", "sdf_arm",
                   "-robot_namespace", "/sdf_arm", "-x", "4", "-J", "elbow", "0.5")  # fmt: skip
        self.assertAlmostEqual(joint("sdf_arm::elbow")[0], 0.5, places=2)
        self.assertTrue(Manager("/sdf_arm").start("states"))
        state = rospy.wait_for_message("/sdf_arm/joint_states", JointState, BOUND)
        self.assertEqual(state.name, ["elbow"])

    def test_4_spawn_model_from_the_database_and_a_parameter(self):
        self.spawn("-sdf", "-database", "crate", "-model", "crate_1", "-x", "8", "-z", "0.5")
        place = position("crate_1")
        self.assertEqual((place.x, place.z), (8.0, 0.5))
        text = self.spawn("-sdf", "-database", "nix", "-model", "crate_2", code=1)
        self.assertIn("model://nix", text)
        rospy.set_param("/a_crate", CRATE)
        self.spawn("-sdf", "-param", "/a_crate", "-model", "crate_3", "-x", "8", "-z", "1",
                   "-reference_frame", "crate_1", "-R", "1.5708")  # fmt: skip
        pose = gazebo("get_model_state", "crate_3", "").pose
        self.assertEqual((pose.position.x, pose.position.z), (16.0, 1.5))
        self.assertAlmostEqual(pose.orientation.x, 0.7071, places=3)

    def test_4_spawn_model_that_is_interrupted(self):
        for arguments in (("-wait", "nobody"), ("-gazebo_namespace", "/nowhere")):
            waiting = self.start("rosrun", "gazebo_ros", "spawn_model", "-sdf", "-database", "crate",
                                 "-model", "late", "__name:=waiting", *arguments,
                                 stderr=subprocess.PIPE, text=True)  # fmt: skip
            self.assertTrue(wait_until(lambda: "/waiting" in rosnode.get_node_names()))
            waiting.send_signal(signal.SIGINT)
            self.assertIn("interrupted", waiting.communicate(timeout=BOUND)[1])
            self.assertEqual(waiting.returncode, 1)
            self.assertTrue(wait_until(lambda: "/waiting" not in rosnode.get_node_names()))

    def test_5_bond(self):
        bond = self.start("rosrun", "gazebo_ros", "spawn_model", "-urdf", "-stdin", "-model", "bond",
                          "-robot_namespace", "/bond", "-b", stdin=subprocess.PIPE)  # fmt: skip
        bond.stdin.write(URDF.encode())
        bond.stdin.close()
        self.assertTrue(wait_until(lambda: "bond" in model_names()))
        bond.send_signal(signal.SIGINT)
        bond.wait(BOUND)
        self.assertTrue(wait_until(lambda: "bond" not in model_names()))

    def test_6_gz(self):
        self.run_command("gz", "world", "-p", "1")
        before = sim_time()
        for arguments, passed in ((("-m", "1500"), 1.5), (("-s",), 1.501), (("-o",), 1.501)):
            self.run_command("gz", "world", *arguments)
            self.assertAlmostEqual(sim_time(), before + passed, places=6)
        for reset in ("-t", "-r"):
            self.run_command("gz", "world", reset)
            self.assertEqual(sim_time(), 0.0)
            self.run_command("gz", "world", "-s")
        address = rosnode.get_api_uri(rosgraph.Master("/test"), "/gazebo")
        with xmlrpc.client.ServerProxy(address) as node:
            self.assertEqual(node.gazeboWorld()[0], -1)
        self.run_command("gz", "world", "-p", "0")
        self.assertTrue(wait_until(lambda: sim_time() > 0.0))

    def test_7_gazebo_interface(self):
        place = (Pose(), "", "/gazebo")
        spawn = gazebo_interface.spawn_urdf_model_client
        self.assertTrue(spawn("e", URDF, "/e", *place))
        self.assertIs(spawn("e", URDF, "/e", *place), False)
        self.assertIsNone(spawn("f", "<sdf/>", "/f", *place))
        move = gazebo_interface.set_model_configuration_client
        self.assertTrue(move("e", "", ["shoulder"], [0.5], "/gazebo"))
        self.assertIs(move("nix", "", ["shoulder"], [0.5], "/gazebo"), False)
        self.assertTrue(gazebo("delete_model", "e").success)

    def test_8_gazebo_is_server_and_window_in_one(self):
        gazebo = self.start("rosrun", "gazebo_ros", "gazebo", "-u", "__ns:=/second", "--seed", "1")
        name = "/second/gazebo/get_world_properties"
        self.assertEqual(call(name, GetWorldProperties).sim_time, 0.0)
        gazebo.send_signal(signal.SIGTERM)
        self.assertEqual(gazebo.wait(BOUND), 0)


if __name__ == "__main__":
    rospy.init_node("gazebo_ros_test")
    rostest.rosrun("cartpole", "gazebo_ros", GazeboRos)
