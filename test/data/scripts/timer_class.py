#!/usr/bin/env python3
"""A class with a timer, a callback and a lock; the main thread waits for them."""

import threading

import rospy
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from std_srvs.srv import Empty


class Controller:
    def __init__(self):
        self.lock = threading.Lock()
        self.state = None
        self.seen = []
        self.done = threading.Event()
        self.command = rospy.Publisher("/stand_cart_position_controller/command", Float64, queue_size=10)
        rospy.Subscriber("/joint_states", JointState, self.on_state, queue_size=1)
        self.timer = rospy.Timer(rospy.Duration(0.02), self.on_timer)

    def on_state(self, message):
        with self.lock:
            self.state = message

    def on_timer(self, event):
        with self.lock:
            if self.state is None:
                return
            angle = self.state.position[0]
            self.seen.append((event.current_real.to_sec(), angle, self.state.position[1]))
        self.command.publish(0.5 * angle)
        if len(self.seen) >= 200:
            self.done.set()


rospy.init_node("timer_class")
rospy.wait_for_service("/gazebo/reset_simulation")
rospy.ServiceProxy("/gazebo/reset_simulation", Empty)()
rospy.ServiceProxy("/gazebo/unpause_physics", Empty)()
controller = Controller()
if not controller.done.wait(timeout=60):
    print("too late")
controller.timer.shutdown()
for line in controller.seen:
    print(*line)
