"""Gazebo's services, launch and models."""
