#!/usr/bin/env python3
"""Asks for a link's state again and again until it has come far enough."""

import rospy
from gazebo_msgs.srv import GetLinkState
from std_msgs.msg import Float64
from std_srvs.srv import Empty

rospy.init_node("poll_link_state")
rospy.wait_for_service("/gazebo/reset_simulation")
rospy.ServiceProxy("/gazebo/reset_simulation", Empty)()
link_state = rospy.ServiceProxy("/gazebo/get_link_state", GetLinkState)
command = rospy.Publisher("/stand_cart_position_controller/command", Float64, queue_size=1, latch=True)
rospy.ServiceProxy("/gazebo/unpause_physics", Empty)()
for goal in (0.2, 0.1, 0.3):
    command.publish(goal)
    while True:
        position = link_state("cart", "world").link_state.pose.position
        print(rospy.get_time(), position.x, position.y)
        if abs(max(abs(position.x), abs(position.y)) - goal) < 0.02:
            break
