"""A stand-in for Gazebo classic: Gazebo's and ros_control's ROS interfaces on `robot_sim`."""

import sys
import warnings
from typing import Any

import robot_sim
from bullet_gazebo.moved import OldNames

__wall_time__ = True  # of its waits, also in a script whose time is simulated

sys.meta_path.append(OldNames())


def __getattr__(name: str) -> Any:
    if name.startswith("_") or name not in robot_sim.__all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    warnings.warn(f"{__name__}.{name} is robot_sim.{name} now", FutureWarning, stacklevel=2)
    return getattr(robot_sim, name)
