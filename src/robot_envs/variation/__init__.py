"""Sim-to-real: imperfect sensors and actuators, and robots that differ from episode to episode.

| module | what it does |
|---|---|
| variation.py | what may differ from a robot as it was made |
| randomisation.py | draws that for each episode, from options |
| parts.py | links, joints and controllers by the names that options have for them |
| applying.py | varies robots on any backend, and restores them |
| imperfections.py | sensors: noise, encoders, delay; actuators: delay, limits, lag |

Nothing here knows ROS or a simulator: all backends are bit-identical.
"""

from robot_envs.variation.variation import LinkScale, Randomisation, Variation

__all__ = ["LinkScale", "Randomisation", "Variation"]
