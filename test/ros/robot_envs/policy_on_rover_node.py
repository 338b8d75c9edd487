#!/usr/bin/env python3
"""A policy on the rover in real time: from /scan and /odom, by /cmd_vel, to its goal, where it stops."""

import math
import time
import unittest

import numpy as np
import rospy
import rostest
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry

from robot_envs.deployment.policy_node import PolicyNode
from robot_envs.robots.rover import ROBOT, Navigate
from ros_calls.waiting import wait_until
from ros_utils import ros_gazebo
from ros_utils.readiness import Ready

BOUND = 120.0  # [s of wall time] for anything
GOAL = (1.0, 1.0)  # [m], between the boxes
SLOWLY = 0.3  # of real time: a busy machine is in time as well


def steer(seen: np.ndarray) -> list[float]:
    """Turns to the goal, then drives."""
    bearing = math.atan2(seen[-3], seen[-4])
    ahead = 1.0 if abs(bearing) < 0.3 else -1.0
    return [ahead if seen[:24].max() < 1.0 else -1.0, max(-1.0, min(1.0, bearing))]


class PolicyOnRover(unittest.TestCase):
    def test_it_drives_to_its_goal_and_stops_there(self):
        rospy.init_node("policy_on_rover")
        Ready(["rover"], ["drive_controller"]).wait(BOUND)
        self.assertTrue(ros_gazebo.gazebo_set_max_update_rate(SLOWLY))
        commands, places = [], []
        rospy.Subscriber("/cmd_vel", Twist, commands.append)
        rospy.Subscriber("/odom", Odometry, lambda each: places.append(each.pose.pose.position))

        def away():
            return math.dist((places[-1].x, places[-1].y), GOAL)

        def is_there():
            stands = len(commands) > 3 and all(c.linear.x == 0.0 for c in commands[-3:])
            return stands and places and away() < 0.35

        node = PolicyNode(ROBOT, Navigate(), steer, ROBOT.control_period, goal=GOAL)
        limit = time.monotonic() + BOUND
        node.run(lambda: is_there() or time.monotonic() > limit)
        self.assertTrue(wait_until(is_there, 1.0, "the end"), f"{places[-1:]}, {commands[-3:]}")
        self.assertTrue(all(0.0 <= each.linear.x <= 0.8 for each in commands))
        self.assertGreater(max(each.linear.x for each in commands), 0.5)
        self.assertTrue(all(abs(each.angular.z) <= 2.0 for each in commands))


if __name__ == "__main__":
    rostest.rosrun("cartpole", "policy_on_rover", PolicyOnRover)
