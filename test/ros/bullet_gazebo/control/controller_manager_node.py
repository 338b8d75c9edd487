#!/usr/bin/env python3
"""The controller manager, its scripts and the spawner, case by case, in one world at time zero."""

import rospy
import rostest
from controller_manager_cases import ControllerManagerTest
from controller_manager_scripts_cases import ScriptsTest
from controller_switch_cases import SwitchTest
from spawner_cases import SpawnerTest
from support.ros.calls import BOUND

__all__ = ["ControllerManagerTest", "ScriptsTest", "SpawnerTest", "SwitchTest"]

if __name__ == "__main__":
    rospy.init_node("controller_manager")
    rospy.wait_for_service("/gazebo/get_world_properties", BOUND)
    rostest.rosrun("cartpole", "controller_manager", "__main__")
