#!/usr/bin/env python3
"""TensorBoard as a ROS node: starts it in this process's place, without roslaunch's arguments."""

import os
import sys

import rospy

if __name__ == "__main__":
    command = [sys.executable, "-m", "tensorboard.main", *rospy.myargv()[1:]]
    os.execv(sys.executable, command)
