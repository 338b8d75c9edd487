"""Backends: physics in this process, or a simulator over ROS, in lock-step or in real time.

Importing this is cheap: a backend's modules are imported when one is made. Only `ros/` needs ROS.
"""

from importlib.util import find_spec
from typing import TYPE_CHECKING

from robot_envs.errors import RobotEnvError

if TYPE_CHECKING:
    from robot_envs.backends.backend import RobotBackend
    from robot_envs.scene import Scene

__all__ = ["BACKENDS", "IN_PROCESS", "LOCKSTEP", "MUJOCO", "OWN", "REALTIME",
           "has_ros", "make_backend", "need_ros"]  # fmt: skip

IN_PROCESS, MUJOCO, LOCKSTEP, REALTIME = "bullet", "mujoco", "ros", "ros-realtime"
OWN = "ros-own"  # lock-step in a simulator that no one else uses
BACKENDS = (IN_PROCESS, MUJOCO, LOCKSTEP, OWN, REALTIME)


def has_ros() -> bool:
    """Returns whether ROS's Python packages can be imported."""
    return find_spec("rospy") is not None


def need_ros(what: str) -> None:
    """Raises RobotEnvError if ROS isn't installed; call it before importing what needs ROS."""
    if not has_ros():
        raise RobotEnvError(f"{what} needs ROS, and there is no rospy: ./ws installs and finds it")


def make_backend(
    scene: "Scene", backend: str | None, control_period: float, deadline: float | None = None,
    renderer: str = "rays",
) -> "RobotBackend":  # fmt: skip
    """Makes a scene's backend, one of `BACKENDS`; over ROS it starts a simulator if none runs.

    The arguments are `RobotEnv`'s. Raises ValueError for an unknown backend, a renderer that can't be had, or
    a control period of a fraction of physics steps; RobotEnvError if ROS isn't installed, or the robots can't
    be brought up.
    """
    from file_access.text import nearest_or_all
    from robot_envs.backends.backend import PHYSICS_STEP, ticks_per_action
    from robot_envs.robot import EMPTY

    name = scene.robots[0].engine if backend is None else backend
    if name not in BACKENDS:
        raise ValueError(f"there is no backend {name!r}{nearest_or_all(str(name), BACKENDS)}")
    if deadline is not None and not (isinstance(deadline, (int, float)) and deadline > 0.0):
        raise ValueError(f"deadline is a time above 0 [s], not {deadline!r}")
    step = scene.robots[0].physics_step
    if step is None and scene.robots[0].world in (None, EMPTY):  # others may have another one
        step = PHYSICS_STEP
    if step and (control_period != 0.0 or name != REALTIME):
        ticks_per_action(control_period, step)  # an error before any simulator is started
    if name in (IN_PROCESS, MUJOCO):
        from robot_envs.backends.in_process import InProcessWorld

        return InProcessWorld(scene, control_period, name, renderer)
    need_ros(f"the backend {name}")
    if name == OWN:
        from robot_envs.backends.ros.own_world import OwnWorld

        return OwnWorld(scene, control_period, deadline, renderer)
    if renderer != "rays":
        raise ValueError(
            f"renderer={renderer!r} is for a simulator of the environment's own; one that others share gets "
            f"it at its start, as in renderer:={renderer} of empty_world.launch"
        )
    from robot_envs.backends.ros.session import running_session

    return running_session(scene, name == REALTIME).connect(scene, control_period, deadline)
