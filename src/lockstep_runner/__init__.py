"""Runs a ROS script, unchanged, in a process whose time is the simulation's (docs/lockstep.md)."""
