#!/usr/bin/env python3
"""All of ros_utils against simulators: two side by side, and a user's session."""

import math
import os
import unittest

import numpy as np
import rosgraph
import rospy
import rostest
from gazebo_msgs.msg import ODEPhysics
from sensor_msgs.msg import JointState
from support.ros.subscribed import wait_until_heard

from ros_calls.waiting import wait_until
from ros_utils import ros_controllers, ros_gazebo, ros_launch, ros_node, ros_spawn
from ros_utils.simulation import CannotSimulate, Simulation

MASTER = rosgraph.Master("/ros_utils_all_test")
CONTROLLERS = ["joint_state_controller", "stand_cart_position_controller"]
BALL = """<sdf version="1.6"><model name="ball"><link name="link">
<inertial><mass>1</mass><inertia><ixx>0.1</ixx><iyy>0.1</iyy><izz>0.1</izz></inertia></inertial>
<collision name="c"><geometry><sphere><radius>0.1</radius></sphere></geometry></collision>
</link></model></sdf>"""


class All(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.simulation = Simulation(paused=True)

    @classmethod
    def tearDownClass(cls):
        assert cls.simulation.close()
        assert cls.simulation.close(), "a second time does nothing"
        assert not cls.simulation.running

    def setUp(self):
        self.enterContext(self.simulation.active())

    def test_masters_do_not_meet(self):
        with Simulation(lockstep=True, seed=1) as other:
            self.assertNotEqual(other.master_uri, self.simulation.master_uri)
            self.assertNotEqual(other.master_uri, os.environ["ROS_MASTER_URI"])
            with other.active():
                self.assertTrue(ros_gazebo.gazebo_spawn_sdf_string(BALL, "there", verify=True))
            self.assertIn("there", other.model_names())
            self.assertNotIn("there", self.simulation.model_names())
            with self.assertRaises(CannotSimulate):
                Simulation(port=int(other.master_uri.rpartition(":")[2]))
        self.assertFalse(other.running)

    def test_steps(self):
        before = ros_gazebo.gazebo_get_world_properties()[1]
        self.assertTrue(ros_gazebo.gazebo_step_physics())
        self.assertTrue(ros_gazebo.gazebo_step_physics(1234))
        after = ros_gazebo.gazebo_get_world_properties()[1]
        self.assertAlmostEqual(after, before + 1.235, places=6)
        self.assertFalse(ros_gazebo.gazebo_step_physics(0))
        self.assertFalse(ros_gazebo.gazebo_step_physics(gazebo_ns="/nix"))

    def test_physics(self):
        self.assertTrue(ros_gazebo.gazebo_set_default_properties())
        self.assertEqual(ros_gazebo.gazebo_get_gravity().z, -9.81)
        self.assertTrue(ros_gazebo.gazebo_set_max_update_rate(10))  # a factor
        self.assertAlmostEqual(ros_gazebo.gazebo_get_max_update_rate(), 10000.0)  # Hz
        self.assertTrue(ros_gazebo.gazebo_set_time_step(0.002))
        self.assertAlmostEqual(ros_gazebo.gazebo_get_max_update_rate(), 5000.0)
        self.assertEqual(ros_gazebo.gazebo_get_time_step(), 0.002)
        self.assertFalse(ros_gazebo.gazebo_set_time_step(0.0))
        self.assertFalse(ros_gazebo.gazebo_set_gravity(0.0, 0.0, math.nan))
        gravity = np.array([0.0, 0.0, -1.0])
        self.assertTrue(ros_gazebo.gazebo_set_physics_properties(gravity=gravity))
        self.assertEqual(ros_gazebo.gazebo_get_time_step(), 0.002, "not named, not changed")
        settings = (False, 0, 70, 1.3, 0, 0.001, 1, 0, 0.2, 20)
        self.assertTrue(ros_gazebo.gazebo_set_ODE_physics(*settings))
        ode = ros_gazebo.gazebo_get_ODE_physics()
        self.assertIsInstance(ode, ODEPhysics)
        self.assertEqual(ode.sor_pgs_iters, 70)
        self.assertTrue(ros_gazebo.gazebo_set_default_properties())

    def test_models(self):
        robot = ("cartpole_gazebo", "cartpole_v1.urdf", "/robots", "plain", "/plain")
        spawned, text = ros_gazebo.gazebo_spawn_urdf_pkg(*robot, verify=True)
        self.assertTrue(spawned, text)
        self.assertTrue(ros_gazebo.gazebo_spawn_sdf_string(BALL, "ball", pos_z=2.0, verify=True))
        self.assertFalse(ros_gazebo.gazebo_spawn_sdf_string(BALL, "ball"))
        self.assertFalse(ros_gazebo.gazebo_spawn_sdf_path("/nix.sdf"))
        self.assertFalse(ros_gazebo.gazebo_spawn_sdf_pkg("nix_pkg", "a.sdf"))
        self.assertFalse(ros_gazebo.gazebo_spawn_sdf_param("nix"))
        self.assertTrue(ros_gazebo.gazebo_set_model_state("ball", pos_x=1.0, pos_z=3.0))
        _, pose, _, succeeded = ros_gazebo.gazebo_get_model_state("ball")
        self.assertTrue(succeeded)
        self.assertAlmostEqual(pose.position.x, 1.0)
        self.assertEqual(pose.orientation.w, 1.0)
        self.assertFalse(ros_gazebo.gazebo_set_model_state("ball", pos_x=math.inf, sleep_time=0))
        pose, _, succeeded = ros_gazebo.gazebo_get_link_state("ball::link")
        self.assertTrue(succeeded)
        pose.position.z = 4.0
        self.assertTrue(ros_gazebo.gazebo_set_link_state("ball::link", pose))
        self.assertAlmostEqual(ros_gazebo.gazebo_get_link_state("ball::link")[0].position.z, 4.0)
        self.assertTrue(ros_gazebo.gazebo_apply_joint_effort("plain::cart_pole", 1.0, 0.01))
        self.assertTrue(ros_gazebo.gazebo_step_physics(10))
        self.assertGreater(ros_gazebo.gazebo_get_joint_properties("plain::cart_pole")[1], 0.0)
        for name in ("plain", "ball"):
            self.assertTrue(ros_gazebo.gazebo_delete_model(name, verify=True))
        self.assertEqual(ros_gazebo.gazebo_get_model_names(), ["ground_plane"])

    def test_handles(self):
        node = ros_node.ros_node_from_pkg(
            "gazebo_ros", "gzclient", name="window", master_uri=self.simulation.master_uri
        )
        self.assertTrue(node)
        self.assertTrue(node.running)
        self.assertTrue(node.close())
        self.assertEqual(node.exit_code(), 0)
        self.assertFalse(ros_launch.ros_launch_from_path("/nix.launch"))
        again = ros_gazebo.launch_Gazebo()
        self.assertTrue(again, "the running one is used")
        self.assertTrue(again.close(), "and left alone")
        self.assertTrue(self.simulation.running)


class Session(unittest.TestCase):
    """What a user calls, in its order, on the test's own master."""

    def test_it(self):
        self.assertTrue(ros_gazebo.launch_Gazebo(paused=True, gui=True))
        self.assertTrue(rospy.has_param("/gazebo/pub_clock_frequency"), "the rate has an effect")
        address = MASTER.lookupNode("/gazebo")
        self.assertTrue(ros_gazebo.launch_Gazebo(), "the running one is used")
        self.assertEqual(MASTER.lookupNode("/gazebo"), address)
        self.spawn()
        self.put_the_joints()
        self.assertTrue(ros_gazebo.gazebo_delete_model("cartpole"))
        self.assertFalse(ros_gazebo.gazebo_delete_model("cartpole"))
        self.assertTrue(ros_gazebo.close_Gazebo())
        kinds = MASTER.getSystemState()
        self.assertNotIn("/gazebo", {node for kind in kinds for _, nodes in kind for node in nodes})
        self.assertFalse(ros_gazebo.gazebo_pause_physics(timeout=0.5), "it is gone")

    def spawn(self):
        spawned = ros_spawn.spawn_model_in_gazebo(
            "cartpole_gazebo", "cartpole_v1.urdf", "joint_position_control.yaml", CONTROLLERS,
            model_urdf_folder="/robots", gazebo_name="cartpole", controllers_pkg="cartpole_controller",
        )  # fmt: skip
        self.assertTrue(spawned)
        types = ros_controllers.list_controller_types_srv()
        self.assertIn("joint_state_controller/JointStateController", types)
        spawned, text = ros_gazebo.gazebo_spawn_urdf_param("robot_description", "cartpole")
        self.assertFalse(spawned)
        self.assertTrue(text)

    def put_the_joints(self):
        self.assertTrue(ros_gazebo.gazebo_unpause_physics())
        self.assertTrue(ros_gazebo.gazebo_pause_physics())
        self.assertTrue(ros_gazebo.gazebo_reset_world())
        self.assertTrue(ros_gazebo.gazebo_reset_sim())
        joints = (["stand_cart", "cart_pole"], [0.1, 0.2])
        heard = []
        rospy.Subscriber("/joint_states", JointState, heard.append)
        self.assertTrue(wait_until_heard("/joint_states"))
        self.assertTrue(ros_gazebo.gazebo_set_model_configuration("cartpole", *joints))
        self.assertTrue(wait_until(lambda: heard, 60.0, "joint states"))
        state = dict(zip(heard[-1].name, heard[-1].position, strict=True))
        self.assertAlmostEqual(state["stand_cart"], 0.1, places=6)
        self.assertAlmostEqual(state["cart_pole"], 0.2, places=6)
        self.assertFalse(ros_gazebo.gazebo_set_model_configuration("nix", *joints))
        self.assertTrue(ros_controllers.reset_controllers_srv(CONTROLLERS))
        self.assertTrue(ros_controllers.kill_controllers_srv(CONTROLLERS))


if __name__ == "__main__":
    rospy.init_node("ros_utils_all_test")
    rostest.rosrun("cartpole", "ros_utils_all", "__main__")
