"""A stand-in for Gazebo classic: Gazebo's and ros_control's ROS interfaces on `robot_sim`."""

from typing import NoReturn

__wall_time__ = True  # of its waits, also in a script whose time is simulated

MOVED = ("ControlError", "Controller", "Input", "Model", "Output", "joint_param", "number_param")
"""Names that were here until 0.3."""


def __getattr__(name: str) -> NoReturn:
    if name in MOVED:
        raise AttributeError(f"{name} is in robot_sim: from robot_sim import {name}")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
