"""Sim-to-real: imperfect sensors and actuators, and robots that differ from episode to episode.

| module | what it does |
|---|---|
| variation.py | what can differ of a robot |
| randomisation.py | draws that for each episode, from options.py, by the names of parts.py |
| applying.py | changes a robot, wherever it moves, and gives it back as it was found |
| inertia.py | what becomes of a link's figures |
| sensing.py | what is measured: noise, encoders, delay |
| actuation.py | what becomes of commands: delay, limits, lag |

Nothing in here knows ROS or a simulator: the same bits on all backends.
"""

from robot_envs.variation.variation import LinkScale, Randomisation, Variation

__all__ = ["LinkScale", "Randomisation", "Variation"]
