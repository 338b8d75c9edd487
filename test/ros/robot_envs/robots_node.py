#!/usr/bin/env python3
"""Bundled robots, a robot that falls, and scenes, one after the other."""

import rostest
from free_robot_cases import FreeRobot
from robots_cases import Robots
from scenes_cases import Arms, Rover
from sensors_cases import Seeing, SeeingInRealTime

__all__ = ["Arms", "FreeRobot", "Robots", "Rover", "Seeing", "SeeingInRealTime"]

if __name__ == "__main__":
    rostest.rosrun("cartpole", "robots", "__main__")
