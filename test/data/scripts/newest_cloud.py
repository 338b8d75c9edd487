#!/usr/bin/env python3
"""A callback keeps the newest cloud's nearest points by sector; a service places the robot."""

import hashlib
import math
import sys
import time

import numpy as np
import rospy
import sensor_msgs.point_cloud2 as pc2
from gazebo_msgs.msg import ModelState
from gazebo_msgs.srv import SetModelState
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from sensor_msgs.msg import PointCloud2
from std_srvs.srv import Empty

TIME_DELTA = 0.1
SECTORS = 20


class Environment:
    def __init__(self):
        rospy.init_node("newest_cloud", anonymous=True)
        self.near = np.ones(SECTORS) * 10
        self.last_odom = None
        self.seen = hashlib.sha256()
        self.velocity = rospy.Publisher("/cmd_vel", Twist, queue_size=1)
        self.unpause = rospy.ServiceProxy("/gazebo/unpause_physics", Empty)
        self.pause = rospy.ServiceProxy("/gazebo/pause_physics", Empty)
        self.reset_world = rospy.ServiceProxy("/gazebo/reset_world", Empty)
        self.place = rospy.ServiceProxy("/gazebo/set_model_state", SetModelState)
        self.cloud = rospy.Subscriber("/velodyne_points", PointCloud2, self.on_cloud, queue_size=1)
        self.odom = rospy.Subscriber("/odom", Odometry, self.on_odom, queue_size=1)

    def on_cloud(self, message):
        points = np.array(list(pc2.read_points(message, field_names=("x", "y", "z"))))
        points = points[points[:, 2] > -0.2]
        angles = np.arctan2(points[:, 1], points[:, 0])
        sector = ((angles + math.pi) / (2 * math.pi) * SECTORS).astype(int) % SECTORS
        self.near = np.ones(SECTORS) * 10
        np.minimum.at(self.near, sector, np.hypot(points[:, 0], points[:, 1]))
        self.seen.update(message.data)

    def on_odom(self, message):
        self.last_odom = message

    def let_pass(self):
        rospy.wait_for_service("/gazebo/unpause_physics")
        self.unpause()
        time.sleep(TIME_DELTA)
        rospy.wait_for_service("/gazebo/pause_physics")
        self.pause()

    def reset(self):
        rospy.wait_for_service("/gazebo/reset_world")
        self.reset_world()
        angle = np.random.uniform(-math.pi, math.pi)
        state = ModelState(model_name="scout")
        state.pose.position.x, state.pose.position.y = np.random.uniform(-0.5, 0.5, 2)
        state.pose.orientation.z = math.sin(angle / 2)
        state.pose.orientation.w = math.cos(angle / 2)
        assert self.place(state).success
        self.let_pass()
        return self.state()

    def step(self, action):
        command = Twist()
        command.linear.x, command.angular.z = 0.3, action
        self.velocity.publish(command)
        self.let_pass()
        hit = self.near.min() < 0.3
        return self.state(), -20.0 if hit else 0.3 - 0.1 * abs(action), hit

    def state(self):
        self.seen.update(str(self.last_odom).encode())
        return np.append(np.minimum(self.near, 3.0) / 3.0, 1.0)


environment = Environment()
turns = (-1.0, 0.0, 1.0)
weights = np.zeros((len(turns), SECTORS + 1))
begin = None
for episode in range(int(sys.argv[1])):
    state, total = environment.reset(), 0.0
    if begin is None:
        begin, simulated = time.time(), rospy.get_time()
    for _ in range(int(sys.argv[2])):
        explores = np.random.rand() < 0.3
        action = np.random.randint(len(turns)) if explores else int(np.argmax(weights @ state))
        following, reward, done = environment.step(turns[action])
        best = 0.0 if done else float(np.max(weights @ following))
        weights[action] += 0.05 * (reward + 0.9 * best - weights[action] @ state) * state
        state = following
        total += reward
        if done:
            break
    print(episode, total, environment.seen.hexdigest())
print("learned", hashlib.sha256(weights.tobytes()).hexdigest())
speed = (rospy.get_time() - simulated) / (time.time() - begin)
print("times real time", speed, file=sys.stderr)
