#!/usr/bin/env python3
"""Q-learning to a goal, a model that comes and goes with each episode; each step waits for a scan."""

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
  <visual name="flag"><geometry><box><size>0.4 0.4 0.01</size></box></geometry></visual>
</link></model></sdf>"""


class Training:
    def __init__(self) -> None:
        self.velocity = rospy.Publisher("cmd_vel", Twist, queue_size=5)
        rospy.Subscriber("odom", Odometry, self.on_odom)
        self.unpause = rospy.ServiceProxy("gazebo/unpause_physics", Empty)
        self.pause = rospy.ServiceProxy("gazebo/pause_physics", Empty)
        self.reset_simulation = rospy.ServiceProxy("gazebo/reset_simulation", Empty)
        self.spawn = rospy.ServiceProxy("gazebo/spawn_sdf_model", SpawnModel)
        self.delete = rospy.ServiceProxy("gazebo/delete_model", DeleteModel)
        self.seen, self.odom, self.has_goal = hashlib.sha256(), Odometry(), False

    def on_odom(self, message: Odometry) -> None:
        self.odom = message

    def scan(self) -> np.ndarray:
        while True:
            try:
                message = rospy.wait_for_message("scan", LaserScan, timeout=5)
                break
            except rospy.ROSException:
                pass
        ranges = np.minimum(np.array(message.ranges), 3.5)
        self.seen.update(ranges.tobytes())
        return ranges

    def state(self) -> tuple[int, bool, bool]:
        ranges, place = self.scan(), self.odom.pose.pose
        yaw = 2.0 * math.atan2(place.orientation.z, place.orientation.w)
        x, y = self.goal[0] - place.position.x, self.goal[1] - place.position.y
        self.far = math.hypot(x, y)
        bearing = (math.atan2(y, x) - yaw + math.pi) % (2.0 * math.pi)
        return int(bearing / (math.pi / 4.0)), ranges.min() < 0.25, self.far < 0.3

    def reset(self) -> int:
        if self.has_goal:
            rospy.wait_for_service("gazebo/delete_model")
            self.delete("goal")
        rospy.wait_for_service("gazebo/reset_simulation")
        self.reset_simulation()
        place = Pose()
        place.position.x, place.position.y = self.goal = (
            random.uniform(-2.0, 2.0),
            random.uniform(-2.0, 2.0),
        )
        rospy.wait_for_service("gazebo/spawn_sdf_model")
        self.spawn("goal", GOAL, "", place, "world")
        self.has_goal = True
        self.unpause()
        return self.state()[0]

    def step(self, action: int) -> tuple[int, float, bool]:
        command = Twist()
        command.linear.x, command.angular.z = 0.15, (2 - action) * 0.75
        self.velocity.publish(command)
        far = self.far
        bearing, hit, arrived = self.state()
        return bearing, 10.0 * (far - self.far) - 100.0 * hit + 100.0 * arrived, hit or arrived


rospy.init_node("wait_for_scan")
training, values = Training(), np.zeros((9, 5))
begin, spent = 0.0, 0.0
for episode in range(int(sys.argv[1])):
    state, total = training.reset(), 0.0
    begin = begin or time.time()
    before = rospy.get_time()
    for _ in range(int(sys.argv[2])):
        explores = random.random() < 0.9 ** (episode + 1)
        action = random.randrange(5) if explores else int(values[state].argmax())
        after, reward, done = training.step(action)
        best = 0.0 if done else values[after].max()
        values[state, action] += 0.3 * (reward + 0.95 * best - values[state, action])
        state, total = after, total + reward
        if done:
            break
    spent += rospy.get_time() - before
    print(episode, total, training.seen.hexdigest())
print("learned", hashlib.sha256(values.tobytes()).hexdigest())
print("times real time", spent / (time.time() - begin), file=sys.stderr)
