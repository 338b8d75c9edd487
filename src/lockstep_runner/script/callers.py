"""Who has called: the script and what it brings, or a library that waits for something that isn't time."""

from __future__ import annotations

import sys
import sysconfig

STANDARD = sysconfig.get_path("stdlib") + "/"
# Their waits are for processes, sockets, files and threads of their own.
LIBRARIES = frozenset(
    # fmt: off
    [
        "bullet_gazebo",
        "catkin_pkg",
        "dynamic_reconfigure",
        "genpy",
        "joblib",
        "lockstep_runner",
        "matplotlib",
        "multiprocess",
        "numpy",
        "optuna",
        "pybullet",
        "ray",
        "rl_workbench",
        "robot_envs",
        "ros_calls",
        "ros_utils",
        "rosgraph",
        "roslaunch",
        "roslib",
        "rosmaster",
        "rosnode",
        "rosparam",
        "rospkg",
        "rospy",
        "rosservice",
        "rostopic",
        "scipy",
        "tensorboard",
        "tensorboardX",
        "tensorflow",
        "torch",
        "tqdm",
        "wandb",
        "xacro",
        "xmlrpc",
    ]
    # fmt: on
)


def is_the_script(depth: int) -> bool:
    """Whether the function `depth` frames above the caller belongs to the script, or a module of its own."""
    frame = sys._getframe(depth + 1)
    path = frame.f_code.co_filename
    if path.startswith("<frozen"):
        return False
    if path.startswith(STANDARD) and "-packages/" not in path:
        return False
    return caller(depth + 1) not in LIBRARIES


def caller(depth: int) -> str:
    """The package or module, by its first name, of the function `depth` frames above the caller."""
    name: str = sys._getframe(depth + 1).f_globals.get("__name__", "")
    return name.partition(".")[0]
