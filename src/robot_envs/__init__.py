"""Any robot as a Gymnasium environment: in this process, or over ROS in lock-step or in real time.

    from robot_envs import InitialState, Robot, RobotEnv, Task, register

A `Robot` (robot.py) describes what it is made of, a `Task` (task.py) what is to be learned, a backend
(backends/) moves it, and `RobotEnv` (environment.py) combines them. `register` gives these a Gymnasium id.

Importing this is cheap; a name's module is imported when the name is first used.
"""

from typing import TYPE_CHECKING

from file_access.lazy import attach

if TYPE_CHECKING:
    from robot_envs.environment import RobotEnv as RobotEnv
    from robot_envs.errors import RobotEnvError as RobotEnvError
    from robot_envs.errors import SimulatorError as SimulatorError
    from robot_envs.registration import register as register
    from robot_envs.robot import EMPTY as EMPTY
    from robot_envs.robot import Robot as Robot
    from robot_envs.snapshot import EnvSnapshot as EnvSnapshot
    from robot_envs.snapshot import InitialStates as InitialStates
    from robot_envs.snapshot import diff as diff
    from robot_envs.task import GoalTask as GoalTask
    from robot_envs.task import Object as Object
    from robot_envs.task import Task as Task
    from robot_envs.world_state import Commands as Commands
    from robot_envs.world_state import InitialState as InitialState
    from robot_envs.world_state import JointState as JointState
    from robot_envs.world_state import LinkQuery as LinkQuery
    from robot_envs.world_state import Motion as Motion
    from robot_envs.world_state import Pose as Pose
    from robot_envs.world_state import Reading as Reading
    from robot_envs.world_state import StateQuery as StateQuery
    from robot_envs.world_state import WorldState as WorldState
    from robot_sim.pictures.camera import Camera as Camera

__wall_time__ = True  # of its waits, also in a script whose time is simulated
__getattr__, __dir__, __all__ = attach(__name__, __path__)
