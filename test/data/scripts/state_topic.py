#!/usr/bin/env python3
"""Starts its own roscore and world, places the robot by a topic, and waits for a scan in each step."""

import hashlib
import math
import os
import subprocess
import sys
import time

import numpy as np
import rospy
from gazebo_msgs.msg import ModelState
from geometry_msgs.msg import Twist
from sensor_msgs.msg import LaserScan
from std_srvs.srv import Empty

port, episodes, steps = sys.argv[1:]
os.environ["ROS_MASTER_URI"] = f"http://localhost:{port}"
started = [subprocess.Popen(["roscore", "-p", port])]
rospy.init_node("state_topic", anonymous=True)
while not rospy.has_param("/run_id"):  # roscore is up
    time.sleep(0.1)
launch = os.path.join(os.path.dirname(os.path.abspath(__file__)), "scout.launch")
started.append(subprocess.Popen(["roslaunch", "-p", port, launch]))

velocity = rospy.Publisher("/cmd_vel", Twist, queue_size=1)
set_state = rospy.Publisher("gazebo/set_model_state", ModelState, queue_size=10)
unpause = rospy.ServiceProxy("/gazebo/unpause_physics", Empty)
pause = rospy.ServiceProxy("/gazebo/pause_physics", Empty)
reset_world = rospy.ServiceProxy("/gazebo/reset_world", Empty)
rospy.wait_for_service("/gazebo/unpause_physics")
seen = hashlib.sha256()
weights = np.random.normal(0.0, 0.1, (2, 10))


def scan():
    data = None
    while data is None:
        try:
            data = rospy.wait_for_message("scan", LaserScan, timeout=5)
        except rospy.ROSException:
            print("no scan")
    seen.update(str(data).encode())
    return np.minimum(np.array(data.ranges), 5.0).reshape(9, 40).min(axis=1)


def reset():
    reset_world()
    state = ModelState()
    state.model_name = "scout"
    angle = np.random.uniform(-math.pi, math.pi)
    state.pose.position.x, state.pose.position.y = np.random.uniform(-0.5, 0.5, 2)
    state.pose.orientation.z, state.pose.orientation.w = math.sin(angle / 2), math.cos(angle / 2)
    set_state.publish(state)
    unpause()
    found = scan()
    pause()
    return found


def step(action):
    command = Twist()
    command.linear.x, command.angular.z = action
    velocity.publish(command)
    unpause()
    found = scan()
    pause()
    hit = found.min() < 0.3
    return found, -10.0 if hit else command.linear.x - 0.2 * abs(command.angular.z), hit


begin = None
for episode in range(int(episodes)):
    ranges, total, gradient = reset(), 0.0, np.zeros_like(weights)
    if begin is None:
        begin, simulated = time.time(), rospy.get_time()
    for _ in range(int(steps)):
        features = np.append(ranges, 1.0)
        mean = weights @ features
        action = mean + np.random.normal(0.0, 0.3, 2)
        ranges, reward, done = step(np.clip(action, (0.0, -1.5), (0.4, 1.5)))
        gradient += np.outer(action - mean, features)
        total += reward
        if done:
            break
    weights += 1e-4 * total * gradient
    print(episode, total, seen.hexdigest())
print("learned", hashlib.sha256(weights.tobytes()).hexdigest())
speed = (rospy.get_time() - simulated) / (time.time() - begin)
print("times real time", speed, file=sys.stderr)
for process in reversed(started):
    process.terminate()
    process.wait()
