"""Who has called: the script and what it brings, or a library that waits for something that isn't time."""

from __future__ import annotations

import sys
import sysconfig
import threading
import types

STANDARD = sysconfig.get_path("stdlib") + "/"
# Their waits are for processes, sockets, files and threads of their own.
LIBRARIES = frozenset(
    # fmt: off
    [
        "bullet_gazebo",
        "catkin_pkg",
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


# Of these the waits are their callers'.
GO_BETWEENS = frozenset(
    ["threading", "queue", "concurrent.futures._base", "concurrent.futures.thread"]
)


def is_the_script(depth: int) -> bool:
    """Whether the function `depth` frames above the caller belongs to the script, or a module of its own.

    A wait in Python's own `queue`, `threading` and `concurrent.futures` counts as that of who called
    them, and one in a `threading.Timer` as the script's.
    """
    frame: types.FrameType | None = sys._getframe(depth + 1)
    while frame is not None and _module(frame) in GO_BETWEENS:
        if _module(frame) == "threading" and frame.f_code is threading.Timer.run.__code__:
            return True
        frame = frame.f_back
    if frame is None:
        return False
    path = frame.f_code.co_filename
    if path.startswith("<frozen"):
        return False
    if path.startswith(STANDARD) and "-packages/" not in path:
        return False
    return _package(frame) not in LIBRARIES


def caller(depth: int) -> str:
    """The package or module, by its first name, of the function `depth` frames above the caller."""
    return _package(sys._getframe(depth + 1))


def _module(frame: types.FrameType) -> str:
    name: str = frame.f_globals.get("__name__", "")
    return name


def _package(frame: types.FrameType) -> str:
    return _module(frame).partition(".")[0]
