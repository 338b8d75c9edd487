#!/usr/bin/env python3
"""Sleeps, then reads what the subscriber has kept."""

import time

import rospy
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from std_srvs.srv import Empty

state = None


def on_state(message):
    global state  # noqa: PLW0603 - as the field writes it
    state = message


rospy.init_node("sleep_read")
rospy.wait_for_service("/gazebo/reset_simulation")
command = rospy.Publisher("/stand_cart_position_controller/command", Float64, queue_size=1)
rospy.Subscriber("/joint_states", JointState, on_state)
rospy.ServiceProxy("/gazebo/reset_simulation", Empty)()
rospy.ServiceProxy("/gazebo/unpause_physics", Empty)()
for step in range(200):
    command.publish(0.01 * (step % 7))
    time.sleep(0.02)
    print(rospy.get_time(), state.position, state.velocity)
