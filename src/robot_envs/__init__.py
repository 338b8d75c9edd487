"""Any robot as a Gymnasium environment: in this process, or over ROS in lock-step or in real time.

    from robot_envs import InitialState, Robot, RobotEnv, Task, register

A `Robot` (robot.py) says what it is made of, a `Task` (task.py) what is to be learned, a backend
(backends/) moves it, and `RobotEnv` (environment.py) puts them together. Knows no robot by name.
"""

from bullet_gazebo.pictures.camera import Camera
from robot_envs.environment import RobotEnv
from robot_envs.errors import RobotEnvError, SimulatorError
from robot_envs.making import register
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
    "Robot",
    "RobotEnv",
    "RobotEnvError",
    "SimulatorError",
    "StateQuery",
    "Task",
    "WorldState",
    "register",
]
