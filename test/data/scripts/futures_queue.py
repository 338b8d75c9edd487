#!/usr/bin/env python3
"""Tasks in a pool that sleep and ask, a queue between callback and main loop, and a timer of Python's."""

import concurrent.futures
import queue
import threading

import rospy
from gazebo_msgs.srv import GetJointProperties
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from std_srvs.srv import Empty

rospy.init_node("futures_queue")
rospy.wait_for_service("/gazebo/reset_simulation")
rospy.ServiceProxy("/gazebo/reset_simulation", Empty)()
rospy.ServiceProxy("/gazebo/unpause_physics", Empty)()
command = rospy.Publisher("/stand_cart_position_controller/command", Float64, queue_size=1)
joint = rospy.ServiceProxy("/gazebo/get_joint_properties", GetJointProperties)
states = queue.Queue()
rospy.Subscriber("/joint_states", JointState, states.put)


def look(number):
    rospy.sleep(0.03 * (number + 1))
    return number, rospy.get_time(), joint("cart_pole").position


with concurrent.futures.ThreadPoolExecutor(max_workers=3) as pool:
    for step in range(5):
        tasks = [pool.submit(look, number) for number in range(4)]
        command.publish(0.02 * step)
        rospy.sleep(0.02)
        for task in concurrent.futures.as_completed(tasks):
            task.result()
        print(*(task.result() for task in tasks))
bells = []
threading.Timer(0.5, lambda: bells.append(rospy.get_time())).start()
while not bells:
    state = states.get(timeout=1.0)
    command.publish(0.1 * state.position[0])
print(state.header.stamp.to_sec(), state.position, bells, states.qsize())
