#!/usr/bin/env python3
"""Sends trajectories to an arm, one after the other, and waits for each result."""

import sys

import actionlib
import rospy
from control_msgs.msg import FollowJointTrajectoryAction, FollowJointTrajectoryGoal
from std_srvs.srv import Empty
from trajectory_msgs.msg import JointTrajectoryPoint

rospy.init_node("trajectory_client")
rospy.wait_for_service("/gazebo/reset_simulation")
rospy.ServiceProxy("/gazebo/reset_simulation", Empty)()
rospy.ServiceProxy("/gazebo/unpause_physics", Empty)()
client = actionlib.SimpleActionClient(
    "/slides/effort_arm/follow_joint_trajectory", FollowJointTrajectoryAction
)
if not client.wait_for_server(rospy.Duration(5.0)):
    sys.exit("no action server")
for positions in ([0.1, 0.05], [-0.1, 0.0], [0.0, 0.1]):
    goal = FollowJointTrajectoryGoal()
    goal.trajectory.joint_names = ["effort_a", "effort_b"]
    goal.trajectory.points = [
        JointTrajectoryPoint(positions=positions, velocities=[0.0, 0.0], time_from_start=rospy.Duration(1.0))
    ]
    client.send_goal(goal, feedback_cb=lambda feedback: print("at", feedback.actual.positions))
    print(client.wait_for_result(rospy.Duration(10.0)), client.get_state(), rospy.get_time())
