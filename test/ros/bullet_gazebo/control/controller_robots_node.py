#!/usr/bin/env python3
"""Trajectories, several robots, and one whose plugins load slowly, case by case, in one world."""

import rospy
import rostest
from controller_robots_cases import RobotsTest
from spawn_hold_cases import SpawnHoldTest
from support.ros.calls import BOUND
from trajectory_cases import TrajectoryTest

__all__ = ["RobotsTest", "SpawnHoldTest", "TrajectoryTest"]

if __name__ == "__main__":
    rospy.init_node("controller_robots")
    rospy.wait_for_service("/gazebo/spawn_urdf_model", BOUND)
    rostest.rosrun("cartpole", "controller_robots", "__main__")
