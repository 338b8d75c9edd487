"""Unchanged ROS scripts in a process whose time is the simulation's (docs/lockstep.md).

The command is `launcher.main`; everything else is private.
"""

__all__ = ["launcher"]
