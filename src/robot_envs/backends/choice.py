"""Backends by name, as the option `backend` of an environment has them."""

from importlib.util import find_spec

from robot_envs.backends.backend import (
    DEFAULT_ENGINE,
    PHYSICS_STEP,
    RobotBackend,
    ticks_per_action,
)
from robot_envs.errors import RobotEnvError
from robot_envs.robot import Robot, State

IN_PROCESS, LOCKSTEP, REALTIME = "bullet", "ros", "ros-realtime"
BACKENDS = (IN_PROCESS, LOCKSTEP, REALTIME)


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
    robot: Robot[State],
    backend: str,
    control_period: float | None,
    height: float = 0.0,
    engine: str = DEFAULT_ENGINE,
) -> RobotBackend[State]:
    """Makes what moves the robot; over ROS it brings up what isn't running.

    Args:
        robot: the robot.
        backend: one of `BACKENDS`.
        control_period: simulated time [s] of one action; in real time None takes the newest joint
            state without waiting for another one.
        height: the least that the robot must be above the ground [m].
        engine: physics in this process: "bullet", or "mujoco"; see
            `bullet_gazebo.physics.engines.registry`.

    Raises:
        ValueError: if there is no such backend or engine, or the control period is no whole number
            of physics steps.
        RobotEnvError: if ROS isn't there, or the robot can't be brought up.
    """
    if backend not in BACKENDS:
        raise ValueError(f"there is no backend {backend!r}; there are {', '.join(BACKENDS)}")
    if backend == IN_PROCESS:
        from robot_envs.backends.in_process import InProcessRobot

        return InProcessRobot(robot, control_period, height, engine)
    if engine != DEFAULT_ENGINE:
        raise ValueError(
            f"engine {engine!r} is for the backend 'bullet'; over ROS the simulator has its own: "
            "start it with physics:=mujoco"
        )
    if control_period is not None or backend == LOCKSTEP:
        ticks_per_action(control_period, PHYSICS_STEP)  # before a simulator is started for it
    need_ros(f"the backend {backend}")
    from robot_envs.backends.session import running_session

    return running_session(robot, backend == REALTIME).connect(control_period, height)
