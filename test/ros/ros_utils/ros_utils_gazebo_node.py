#!/usr/bin/env python3
"""The client helpers against the stand-in, in the order in which a user calls them."""

import sys
import time
import unittest
from pathlib import Path

import rosgraph
import rospy
import rostest
from sensor_msgs.msg import JointState

from ros_utils import ros_controllers, ros_gazebo, ros_node, ros_params, ros_spawn

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
from support.ros.subscribed import wait_until_heard

CONTROLLERS = ["joint_state_controller", "stand_cart_position_controller"]


def registered():
    state = rosgraph.Master("/test").getSystemState()
    return {node for kind in state for _, nodes in kind for node in nodes}


class Gazebo(unittest.TestCase):
    def test_session(self):
        self.launch()
        self.spawn()
        self.steer()
        self.spawner_node()
        self.close()

    def launch(self):
        self.assertTrue(ros_gazebo.launch_Gazebo(paused=True, gui=True))
        self.assertIn("/gazebo", registered())
        self.assertTrue(rospy.has_param("/gazebo/pub_clock_frequency"), "the rate has an effect")
        address = rosgraph.Master("/test").lookupNode("/gazebo")
        self.assertTrue(ros_gazebo.launch_Gazebo(), "the running one is used")
        self.assertEqual(rosgraph.Master("/test").lookupNode("/gazebo"), address)

    def spawn(self):
        self.assertTrue(
            ros_params.ros_load_yaml_from_pkg("cartpole_controller", "joint_position_control.yaml")
        )
        self.assertTrue(
            ros_spawn.spawn_model_in_gazebo(
                "cartpole_gazebo",
                "cartpole_v1.urdf",
                "joint_position_control.yaml",
                CONTROLLERS,
                model_urdf_folder="/robots",
                gazebo_name="cartpole",
                controllers_pkg="cartpole_controller",
            )
        )
        spawned, text = ros_gazebo.gazebo_spawn_urdf_param("robot_description", "cartpole")
        self.assertFalse(spawned)
        self.assertTrue(text)

    def steer(self):
        succeeded, _, models = ros_gazebo.gazebo_get_world_properties()
        self.assertTrue(succeeded)
        self.assertIn("cartpole", models)
        self.assertTrue(ros_gazebo.gazebo_get_model_state("cartpole")[3])
        self.assertFalse(ros_gazebo.gazebo_get_model_state("nix")[3])
        self.assertTrue(ros_gazebo.gazebo_unpause_physics())
        self.assertTrue(ros_gazebo.gazebo_pause_physics())
        self.assertTrue(ros_gazebo.gazebo_reset_world())
        self.assertTrue(ros_gazebo.gazebo_reset_sim())
        joints = (["stand_cart", "cart_pole"], [0.1, 0.2])
        heard = []
        rospy.Subscriber("/joint_states", JointState, heard.append)
        deadline = time.monotonic() + 60.0
        self.assertTrue(wait_until_heard("/joint_states"))
        self.assertTrue(ros_gazebo.gazebo_set_model_configuration("cartpole", *joints))
        while not heard and time.monotonic() < deadline:
            time.sleep(0.02)
        state = dict(zip(heard[-1].name, heard[-1].position, strict=True))
        self.assertAlmostEqual(state["stand_cart"], 0.1, places=6)
        self.assertAlmostEqual(state["cart_pole"], 0.2, places=6)
        self.assertFalse(ros_gazebo.gazebo_set_model_configuration("nix", *joints))
        self.assertTrue(ros_controllers.reset_controllers_srv(CONTROLLERS))
        self.assertTrue(ros_controllers.kill_controllers_srv(CONTROLLERS))

    def spawner_node(self):
        """The executable of package controller_manager; it unloads what it loaded."""
        self.assertTrue(
            ros_node.ros_node_from_pkg(
                "controller_manager", "spawner", name="spawner", args=" ".join(CONTROLLERS)
            )
        )
        self.wait_for_states(dict.fromkeys(CONTROLLERS, "running"))
        self.assertTrue(ros_node.ros_kill_node("/spawner"))
        self.wait_for_states({})

    def wait_for_states(self, expected):
        deadline = time.monotonic() + 60.0
        while ros_controllers.list_controllers_srv() != expected:
            self.assertLess(time.monotonic(), deadline, ros_controllers.list_controllers_srv())
            time.sleep(0.05)

    def close(self):
        self.assertTrue(ros_gazebo.gazebo_delete_model("cartpole"))
        self.assertFalse(ros_gazebo.gazebo_delete_model("cartpole"))
        self.assertTrue(ros_gazebo.close_Gazebo())
        self.assertNotIn("/gazebo", registered())
        self.assertFalse(ros_gazebo.gazebo_pause_physics(timeout=0.5), "it is gone")


if __name__ == "__main__":
    rospy.init_node("ros_utils_gazebo_test")
    rostest.rosrun("cartpole", "ros_utils_gazebo", Gazebo)
