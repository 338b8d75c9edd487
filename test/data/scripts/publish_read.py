#!/usr/bin/env python3
"""Launches its world and robot by ros_utils, starts helpers, and never sleeps while it acts."""

import random
import time

import rospy
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64

from ros_utils import ros_gazebo, ros_node, ros_params, ros_urdf

state = None


def on_state(message):
    global state  # noqa: PLW0603 - as the field writes it
    state = message


ros_node.ros_kill_all_processes()
ros_gazebo.launch_Gazebo(paused=True, gui=False, launch_new_term=False)
rospy.init_node("publish_read", anonymous=True)
assert ros_urdf.urdf_load_from_pkg(
    "cartpole_gazebo", "cartpole_v1.urdf", "robot_description", folder="/robots"
)
ok, text = ros_gazebo.gazebo_spawn_urdf_param("robot_description", model_name="cartpole")
assert ok, text
assert ros_params.ros_load_yaml_from_pkg("cartpole_controller", "joint_position_control.yaml")
ros_node.ros_node_from_pkg(
    "controller_manager",
    "spawner",
    launch_new_term=False,
    name="spawner",
    args="joint_state_controller stand_cart_position_controller",
)
ros_node.ros_node_from_pkg(
    "joint_state_publisher", "joint_state_publisher", launch_new_term=False, name="joint_state_publisher"
)
command = rospy.Publisher("/stand_cart_position_controller/command", Float64, queue_size=1)
rospy.Subscriber("/joint_states", JointState, on_state)
for episode in range(4):
    ros_gazebo.gazebo_reset_world()
    ros_gazebo.gazebo_set_model_configuration("cartpole", ["stand_cart", "cart_pole"], [0.0, 0.0])
    ros_gazebo.gazebo_pause_physics()
    time.sleep(0.1)
    position = 0.0
    for step in range(50):
        ros_gazebo.gazebo_unpause_physics()
        position += random.choice((-0.02, 0.02))
        command.publish(position)
        if state is not None:
            print(episode, step, position, state.position, state.velocity)
    time.sleep(0.05)
ros_gazebo.close_Gazebo()
