"""Calls Gazebo's services, launches it, and spawns models."""
