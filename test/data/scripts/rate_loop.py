#!/usr/bin/env python3
"""A loop at 50 Hz."""

import rospy
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from std_srvs.srv import Empty

rospy.init_node("rate_loop")
rospy.wait_for_service("/gazebo/reset_simulation")
rospy.ServiceProxy("/gazebo/reset_simulation", Empty)()
rospy.ServiceProxy("/gazebo/unpause_physics", Empty)()
newest = {}
rospy.Subscriber("/joint_states", JointState, lambda message: newest.update(state=message))
command = rospy.Publisher("/stand_cart_position_controller/command", Float64, queue_size=1)
rate = rospy.Rate(50)
steps = 0
while not rospy.is_shutdown() and steps < 200:
    if "state" in newest:
        steps += 1
        angle = newest["state"].position[0]
        command.publish(0.5 * angle)
        print(rospy.Time.now().to_sec(), newest["state"].position)
    rate.sleep()
