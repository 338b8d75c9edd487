#!/usr/bin/env python3
"""Something beside the main loop sleeps in a thread of its own, by the wall clock."""

import threading
import time

import rospy
from std_srvs.srv import Empty

stop = False


def beat():
    while not stop:
        time.sleep(0.01)


rospy.init_node("sleeping_thread")
rospy.wait_for_service("/gazebo/reset_simulation")
rospy.ServiceProxy("/gazebo/reset_simulation", Empty)()
rospy.ServiceProxy("/gazebo/unpause_physics", Empty)()
thread = threading.Thread(target=beat, name="heart")
thread.start()
for _ in range(20):
    time.sleep(0.05)
    print(rospy.get_time())
stop = True
thread.join()
