"""Calls of ROS services, nodes and masters that end within a time limit.

A leaf: it imports nothing of this repository, and works wherever ROS is installed. Importing it needs neither
master nor node: `master` and `absence` don't import rospy, and `requirements`, which programs import first,
needs only Python.
"""
