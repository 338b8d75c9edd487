"""Calls of ROS services, nodes and masters that end within a time limit.

A leaf: it imports nothing of this repository, and may be imported wherever ROS is. Importing it needs no
master, and no node: `xmlrpc` and `master` don't even import rospy.
"""
