"""Gazebo's services, launch and spawning."""
