#!/usr/bin/env python3
"""Two simulators side by side, each with a master of its own, and all that ros_utils asks of them."""

import math
import os
import unittest

import rospy
import rostest
from gazebo_msgs.msg import ODEPhysics

from ros_utils import ros_controllers, ros_gazebo, ros_launch, ros_node, ros_spawn
from ros_utils.simulation import CannotSimulate, Simulation

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
        block = self.simulation.active()
        block.__enter__()
        self.addCleanup(block.__exit__, None, None, None)

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
        self.assertTrue(ros_gazebo.gazebo_set_physics_properties(gravity=(0.0, 0.0, -1.0)))
        self.assertEqual(ros_gazebo.gazebo_get_time_step(), 0.002, "not named, not changed")
        self.assertTrue(
            ros_gazebo.gazebo_set_ODE_physics(False, 0, 70, 1.3, 0, 0.001, 1, 0, 0.2, 20)
        )
        ode = ros_gazebo.gazebo_get_ODE_physics()
        self.assertIsInstance(ode, ODEPhysics)
        self.assertEqual(ode.sor_pgs_iters, 70)
        self.assertTrue(ros_gazebo.gazebo_set_default_properties())

    def test_models(self):
        spawned, text = ros_gazebo.gazebo_spawn_urdf_pkg(
            "cartpole_gazebo", "cartpole_v1.urdf", "/robots", "plain", "/plain", verify=True
        )
        self.assertTrue(spawned, text)
        self.assertIs(
            ros_gazebo.gazebo_spawn_sdf_string(BALL, "ball", pos_z=2.0, verify=True), True
        )
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

    def test_robot_with_controllers(self):
        self.assertTrue(
            ros_spawn.spawn_model_in_gazebo(
                "cartpole_gazebo",
                "cartpole_v1.urdf",
                "joint_position_control.yaml",
                CONTROLLERS,
                model_urdf_folder="/robots",
                gazebo_name="cartpole",
                controllers_pkg="cartpole_controller",
                verify=True,
            )
        )
        states = dict.fromkeys(CONTROLLERS, "running")
        self.assertEqual(ros_controllers.list_controllers_srv(), states)
        self.assertIn(
            "joint_state_controller/JointStateController",
            ros_controllers.list_controller_types_srv(),
        )
        loaded = ros_controllers.load_controller_list_srv(["nix"], max_retries=1)
        self.assertFalse(loaded)
        self.assertEqual(loaded.failed, ["nix"])
        self.assertFalse(ros_controllers.load_controller_srv("nix", max_retries=0))
        self.assertTrue(ros_controllers.kill_controllers_srv(CONTROLLERS))
        self.assertTrue(ros_gazebo.gazebo_delete_model("cartpole", verify=True))
        self.assertTrue(ros_node.ros_kill_node("/rob_st_pub"))

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


if __name__ == "__main__":
    rospy.init_node("ros_utils_all_test")
    rostest.rosrun("cartpole", "ros_utils_all", All)
