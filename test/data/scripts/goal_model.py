#!/usr/bin/env python3
"""Q-learning to a goal, a model that comes and goes with each episode; steps sleep, and look."""

import hashlib
import math
import random
import sys
import time

import numpy as np
import rospy
from gazebo_msgs.srv import DeleteModel, SpawnModel
from geometry_msgs.msg import Pose, Twist
from nav_msgs.msg import Odometry
from sensor_msgs.msg import LaserScan
from std_srvs.srv import Empty

GOAL = """<sdf version="1.6"><model name="goal"><static>true</static><link name="link">
  <visual name="flag">
    <geometry><cylinder><radius>0.2</radius><length>0.01</length></cylinder></geometry>
  </visual>
</link></model></sdf>"""
GOALS = [(0.8, 0.0), (0.0, 2.2), (-0.8, 0.2), (0.2, -2.2), (2.4, 0.0)]
TURNS = (-1.2, 0.0, 1.2)


class World:
    def __init__(self):
        self.velocity = rospy.Publisher("cmd_vel", Twist, queue_size=5)
        rospy.Subscriber("odom", Odometry, self.on_odom)
        rospy.Subscriber("scan", LaserScan, self.on_scan)
        self.unpause = rospy.ServiceProxy("gazebo/unpause_physics", Empty)
        self.pause = rospy.ServiceProxy("gazebo/pause_physics", Empty)
        self.reset_simulation = rospy.ServiceProxy("gazebo/reset_simulation", Empty)
        self.spawn = rospy.ServiceProxy("gazebo/spawn_sdf_model", SpawnModel)
        self.delete = rospy.ServiceProxy("gazebo/delete_model", DeleteModel)
        self.odom = self.scan = None
        self.has_goal = False
        self.seen = hashlib.sha256()

    def on_odom(self, message):
        self.odom = message

    def on_scan(self, message):
        self.scan = message

    def reset(self):
        rospy.wait_for_service("gazebo/reset_simulation")
        self.reset_simulation()
        if self.has_goal:
            rospy.wait_for_service("gazebo/delete_model")
            self.delete("goal")
        place = Pose()
        place.position.x, place.position.y = self.goal = random.choice(GOALS)
        rospy.wait_for_service("gazebo/spawn_sdf_model")
        self.spawn("goal", GOAL, "", place, "world")
        self.has_goal = True
        self.scan = None
        while self.scan is None:
            self.let_pass(0.1)
        self.far = self.distance()
        return self.state()

    def step(self, action):
        command = Twist()
        command.linear.x, command.angular.z = 0.3, TURNS[action]
        self.velocity.publish(command)
        self.let_pass(0.1)
        far, self.far = self.far, self.distance()
        near = min(self.scan.ranges)
        arrived, hit = self.far < 0.3, near < 0.25
        reward = 10.0 * (far - self.far) + 20.0 * arrived - 20.0 * hit
        return self.state(), reward, arrived or hit

    def let_pass(self, seconds):
        self.unpause()
        time.sleep(seconds)
        self.pause()

    def distance(self):
        position = self.odom.pose.pose.position
        return math.hypot(self.goal[0] - position.x, self.goal[1] - position.y)

    def state(self):
        ranges = np.array(self.scan.ranges)
        ranges[np.isinf(ranges)] = 5.0
        pose = self.odom.pose.pose
        self.seen.update(ranges.tobytes())
        self.seen.update(str(self.odom).encode())
        yaw = 2.0 * math.atan2(pose.orientation.z, pose.orientation.w)
        bearing = math.atan2(self.goal[1] - pose.position.y, self.goal[0] - pose.position.x) - yaw
        sectors = [ranges[a:b].min() for a, b in ((120, 160), (160, 200), (200, 240))]
        blocked = tuple(int(each < 0.6) for each in sectors)
        return (*blocked, int((bearing + math.pi) % (2.0 * math.pi) / (math.pi / 4.0)))


rospy.init_node("goal_model")
world, table = World(), {}
begin, spent = time.time(), 0.0
for episode in range(int(sys.argv[1])):
    state, total = world.reset(), 0.0
    for _ in range(int(sys.argv[2])):
        values = table.setdefault(state, [0.0] * len(TURNS))
        explores = random.random() < 0.9 ** (episode + 1)
        action = random.randrange(len(TURNS)) if explores else values.index(max(values))
        state, reward, done = world.step(action)
        best = 0.0 if done else max(table.get(state, [0.0]))
        values[action] += 0.3 * (reward + 0.95 * best - values[action])
        total += reward
        if done:
            break
    spent += rospy.get_time()
    print(episode, total, world.seen.hexdigest())
print("learned", hashlib.sha256(repr(table).encode()).hexdigest())
print("times real time", spent / (time.time() - begin), file=sys.stderr)
