"""Unchanged ROS scripts in the simulation's time (docs/lockstep.md); the command is `launcher.main`."""

__all__ = ["launcher"]
