"""Calls of ROS services, nodes and masters, and of xacro, that end within a time limit.

A leaf: it imports nothing of this repository, and may be imported wherever ROS is. Importing it needs no
master, and no node: `xmlrpc` and `master` don't even import rospy, `expansion` imports no ROS at all, and
`requirements`, with which programs begin, nothing but Python.
"""
