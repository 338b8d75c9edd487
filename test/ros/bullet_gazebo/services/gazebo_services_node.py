#!/usr/bin/env python3
"""Gazebo's services, case by case, in one paused world."""

import rospy
import rostest
from gazebo_forces_cases import ForcesTest
from gazebo_joints_cases import JointsTest
from gazebo_links_cases import LinksTest
from gazebo_models_cases import ModelsTest
from gazebo_physics_cases import PhysicsTest

__all__ = ["ForcesTest", "JointsTest", "LinksTest", "ModelsTest", "PhysicsTest"]

if __name__ == "__main__":
    rospy.init_node("gazebo_services")
    rostest.rosrun("cartpole", "gazebo_services", "__main__")
