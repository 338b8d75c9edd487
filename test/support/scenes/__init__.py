"""Worlds with more to them than one fixed robot: for tests in-process and over ROS."""
