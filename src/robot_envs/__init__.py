"""Any robot as a Gymnasium environment: in this process, or over ROS in lock-step or in real time.

    from robot_envs import InitialState, Robot, RobotEnv, Task, register

A `Robot` (robot.py) describes what it is made of, a `Task` (task.py) what is to be learned, a backend
(backends/) moves it, and `RobotEnv` (environment.py) combines them. `register` gives these a Gymnasium id.

Importing this is cheap; a name's module is imported when the name is first used.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from bullet_gazebo.pictures.camera import Camera
    from robot_envs.environment import RobotEnv
    from robot_envs.errors import RobotEnvError, SimulatorError
    from robot_envs.registration import register
    from robot_envs.robot import EMPTY, Robot
    from robot_envs.task import GoalTask, Object, Task
    from robot_envs.world_state import (
        Commands,
        InitialState,
        JointState,
        LinkQuery,
        Motion,
        Pose,
        StateQuery,
        WorldState,
    )

__wall_time__ = True  # of its waits, also in a script whose time is simulated
__all__ = [
    "EMPTY",
    "Camera",
    "Commands",
    "GoalTask",
    "InitialState",
    "JointState",
    "LinkQuery",
    "Motion",
    "Object",
    "Pose",
    "Reading",
    "Robot",
    "RobotEnv",
    "RobotEnvError",
    "SimulatorError",
    "StateQuery",
    "Task",
    "WorldState",
    "register",
]

_MODULES = {
    "bullet_gazebo.pictures.camera": ("Camera",),
    "robot_envs.environment": ("RobotEnv",),
    "robot_envs.errors": ("RobotEnvError", "SimulatorError"),
    "robot_envs.registration": ("register",),
    "robot_envs.robot": ("EMPTY", "Robot"),
    "robot_envs.task": ("GoalTask", "Object", "Task"),
}


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module 'robot_envs' has no attribute '{name}'")
    modules = (module for module, names in _MODULES.items() if name in names)
    found = getattr(import_module(next(modules, "robot_envs.world_state")), name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return [*globals(), *__all__]
