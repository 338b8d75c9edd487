"""Robots over ROS: brought up, commanded and read; the only place of this library where rospy is imported."""
