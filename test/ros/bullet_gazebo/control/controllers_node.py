#!/usr/bin/env python3
"""Each type of controller, gains and limits, case by case, in one world in lock-step."""

import rospy
import rostest
from control_hardware_cases import HardwareTest
from controllers_cases import ControllersTest
from gains_cases import GainsTest

__all__ = ["ControllersTest", "GainsTest", "HardwareTest"]

if __name__ == "__main__":
    rospy.init_node("controllers")
    rostest.rosrun("cartpole", "controllers", "__main__")
