#!/usr/bin/env python3
"""Callbacks that command, a thread with a rate beside them, and rospy.spin until it shuts the node down."""

import threading

import message_filters
import rospy
from control_msgs.msg import JointControllerState
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from std_srvs.srv import Empty

seen = []


def on_both(joints, controller):
    command.publish(Float64(0.4 * joints.position[0] + 0.001 * (len(seen) % 20)))
    seen.append((joints.header.stamp.to_sec(), joints.position, controller.process_value))


def beat():
    rate = rospy.Rate(50)
    for count in range(1000):
        heart.publish(count)
        seen.append((rospy.get_time(), "beat", count))
        if count == 75:
            rospy.signal_shutdown("enough")
            return
        rate.sleep()


if __name__ == "__main__":
    rospy.init_node("callbacks_rate")
    rospy.wait_for_service("/gazebo/reset_simulation")
    rospy.ServiceProxy("/gazebo/reset_simulation", Empty)()
    command = rospy.Publisher("/stand_cart_position_controller/command", Float64, queue_size=1)
    heart = rospy.Publisher("/heartbeat", Float64, queue_size=1)
    joint_states = message_filters.Subscriber("/joint_states", JointState)
    controller_states = message_filters.Subscriber(
        "/stand_cart_position_controller/state", JointControllerState
    )
    both = message_filters.ApproximateTimeSynchronizer([joint_states, controller_states], 10, 0.01)
    both.registerCallback(on_both)
    rospy.ServiceProxy("/gazebo/unpause_physics", Empty)()
    thread = threading.Thread(target=beat)
    thread.start()
    rospy.spin()
    thread.join()
    for line in seen:
        print(*line)
