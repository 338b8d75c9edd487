"""Sim-to-real, without ROS and simulator: imperfect sensors and actuators, robots that differ."""

from robot_envs.variation.variation import LinkScale, Randomisation, Variation

__all__ = ["LinkScale", "Randomisation", "Variation"]
