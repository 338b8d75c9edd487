#!/usr/bin/env python3
"""An environment whose step unpauses, waits for a message, and pauses."""

import random

import rospy
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from std_srvs.srv import Empty


class CartPole:
    def __init__(self):
        self.unpause = rospy.ServiceProxy("/gazebo/unpause_physics", Empty)
        self.pause = rospy.ServiceProxy("/gazebo/pause_physics", Empty)
        self.reset_simulation = rospy.ServiceProxy("/gazebo/reset_simulation", Empty)
        self.command = rospy.Publisher("/stand_cart_position_controller/command", Float64, queue_size=1)

    def state(self):
        data = None
        while data is None:
            try:
                data = rospy.wait_for_message("/joint_states", JointState, timeout=5)
            except rospy.ROSException:
                print("no joint states")
        return list(data.position) + list(data.velocity)

    def reset(self):
        rospy.wait_for_service("/gazebo/reset_simulation")
        self.reset_simulation()
        self.unpause()
        state = self.state()
        self.pause()
        return state

    def step(self, action):
        self.unpause()
        self.command.publish(action)
        state = self.state()
        self.pause()
        return state, abs(state[0]) > 0.5


rospy.init_node("pause_environment")
environment = CartPole()
for episode in range(3):
    print(episode, environment.reset())
    for _ in range(60):
        state, done = environment.step(random.uniform(-0.1, 0.1))
        print(rospy.get_time(), state, done)
        if done:
            break
