"""Backends over ROS."""
