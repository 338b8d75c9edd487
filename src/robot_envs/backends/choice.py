"""Backends by name, as the option `backend` of an environment has them."""

from importlib.util import find_spec

from bullet_gazebo.state import did_you_mean
from robot_envs.backends.backend import PHYSICS_STEP, RobotBackend, ticks_per_action
from robot_envs.errors import RobotEnvError
from robot_envs.robot import EMPTY
from robot_envs.scene import Scene

IN_PROCESS, MUJOCO, LOCKSTEP, REALTIME = "bullet", "mujoco", "ros", "ros-realtime"
OWN = "ros-own"  # lock-step in a simulator that nobody else has
BACKENDS = (IN_PROCESS, MUJOCO, LOCKSTEP, OWN, REALTIME)


def has_ros() -> bool:
    """Whether ROS's Python packages are there to be imported."""
    return find_spec("rospy") is not None


def need_ros(what: str) -> None:
    """Makes sure of it, before something imports them.

    Raises:
        RobotEnvError: if they aren't there.
    """
    if not has_ros():
        raise RobotEnvError(f"{what} needs ROS, and there is no rospy: ./ws installs and finds it")


def make_backend(
    scene: Scene, backend: str | None, control_period: float, deadline: float | None = None
) -> RobotBackend:
    """Makes what moves a scene's robots; over ROS it brings up what isn't running.

    Args:
        scene: the robots and objects.
        backend: one of `BACKENDS`; None: in this process, with the first robot's engine.
        control_period: simulated time [s] of one action; in real time 0 takes the newest joint
            state without waiting for another one.
        deadline: wall time [s] that an answer may take, beside 10 ms for each tick, of a simulator over ROS
            in lock-step; None: as the backend has it.

    Raises:
        ValueError: if there is no such backend, or the control period is no whole number of physics
            steps.
        RobotEnvError: if ROS isn't there, or the robots can't be brought up.
    """
    name = scene.robots[0].engine if backend is None else backend
    if name not in BACKENDS:
        near = did_you_mean(str(name), BACKENDS) or f"; there are {', '.join(BACKENDS)}"
        raise ValueError(f"there is no backend {name!r}{near}")
    if deadline is not None and not (isinstance(deadline, (int, float)) and deadline > 0.0):
        raise ValueError(f"deadline is a time above 0 [s], not {deadline!r}")
    plain = scene.robots[0].world in (None, EMPTY)  # other worlds may have another physics step
    if plain and (control_period != 0.0 or name != REALTIME):
        ticks_per_action(control_period, PHYSICS_STEP)  # before a simulator is started for it
    if name in (IN_PROCESS, MUJOCO):
        from robot_envs.backends.in_process import InProcessWorld

        return InProcessWorld(scene, control_period, name)
    need_ros(f"the backend {name}")
    if name == OWN:
        from robot_envs.backends.ros.own_world.world import RestartingWorld

        return RestartingWorld(scene, control_period, deadline)
    from robot_envs.backends.ros.session import running_session

    return running_session(scene, name == REALTIME).connect(scene, control_period, deadline)
