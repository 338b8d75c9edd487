#!/usr/bin/env python3
"""Answers each message of /joint_states with a command: the cart goes half way to 0.3 m."""

import rospy
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64


def answer(state):
    cart = state.position[state.name.index("stand_cart")]
    commands.publish(0.5 * (0.3 + cart))


rospy.init_node("half_way")
commands = rospy.Publisher("/stand_cart_position_controller/command", Float64, queue_size=1)
rospy.Subscriber("/joint_states", JointState, answer, queue_size=1)
rospy.spin()
