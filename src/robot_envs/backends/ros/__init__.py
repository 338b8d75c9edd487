"""Robots over ROS: brought up, commanded and read."""
