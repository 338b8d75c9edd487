#!/usr/bin/env python3
"""Gazebo's services and topics, case by case, in one paused world."""

import rospy
import rostest
from gazebo_forces_cases import ForcesTest
from gazebo_joints_cases import JointsTest
from gazebo_links_cases import LinksTest
from gazebo_models_cases import ModelsTest
from gazebo_physics_cases import PhysicsTest
from stand_in_cases import StandInTest
from surface_cases import SurfaceTest

__all__ = ["ForcesTest", "JointsTest", "LinksTest", "ModelsTest", "PhysicsTest", "StandInTest", "SurfaceTest"]

if __name__ == "__main__":
    rospy.init_node("gazebo_services")
    rostest.rosrun("cartpole", "gazebo_services", "__main__")
