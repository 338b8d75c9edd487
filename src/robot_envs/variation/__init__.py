"""Sim-to-real: imperfect sensors and actuators, and robots that differ from episode to episode.

Nothing here knows ROS or a simulator: all backends are bit-identical.
"""

from robot_envs.variation.variation import LinkScale, Randomisation, Variation

__all__ = ["LinkScale", "Randomisation", "Variation"]
