"""Learners: they know networks and episodes, neither ROS nor an environment."""
