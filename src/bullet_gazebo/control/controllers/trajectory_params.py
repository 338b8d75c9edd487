"""The parameters of a JointTrajectoryController (docs/contract/ros_control.md 3.5)."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from bullet_gazebo.control.controllers.base import number_param
from bullet_gazebo.control.errors import ControlError
from bullet_gazebo.control.joint import JointHandle
from bullet_gazebo.control.pid import Pid
from bullet_gazebo.control.trajectory.axis import Axis
from bullet_gazebo.control.trajectory.segment import NANOSECONDS
from bullet_gazebo.control.trajectory.tolerances import Constraints, Tolerance

SLOWEST = 1e-6  # [Hz]; below it, as at 0, no state is published
STOPPED_VELOCITY = 0.01  # [rad/s, m/s]
FOR_EVER = 1e12  # [s]; longer durations are cut, as no clock tells them


class Settings(NamedTuple):
    """The parameters that aren't about one joint. Times in [ns]."""

    state_period: int  # 0: no state is published
    monitor_period: int
    stop_duration: int
    partial: bool
    constraints: Constraints


def read_settings(
    params: Mapping[str, object], joints: Sequence[JointHandle], name: str
) -> Settings:
    """Reads the settings of controller `name`.

    Raises:
        ControlError: if a parameter is of the wrong type.
    """
    state_rate = _number(params, "state_publish_rate", 50.0, name)
    monitor_rate = _number(params, "action_monitor_rate", 20.0, name)
    if monitor_rate <= SLOWEST:
        raise ControlError(f"parameter {name}/action_monitor_rate must be more than 0 [Hz]")
    partial = params.get("allow_partial_joints_goal", False)
    if not isinstance(partial, bool):
        raise ControlError(
            f"parameter {name}/allow_partial_joints_goal must be true or false: {partial!r}"
        )
    return Settings(
        round(NANOSECONDS / state_rate) if state_rate > SLOWEST else 0,
        round(NANOSECONDS / monitor_rate),
        _duration(params, "stop_trajectory_duration", name),
        partial,
        _constraints(_tree(params, "constraints", name), joints, f"{name}/constraints"),
    )


def read_axes(params: Mapping[str, object], joints: Sequence[JointHandle], name: str) -> list[Axis]:
    """Makes axes with a PID from `gains` and `velocity_ff`.

    Raises:
        ControlError: if a joint has no gains, or a parameter is of the wrong type.
    """
    gains, feed = _tree(params, "gains", name), _tree(params, "velocity_ff", name)
    axes = []
    for joint in joints:
        pid = Pid.from_params(gains.get(joint.name), f"{name}/gains/{joint.name}")
        axes.append(Axis(joint, pid, _number(feed, joint.name, 0.0, f"{name}/velocity_ff")))
    return axes


def _constraints(
    params: Mapping[str, object], joints: Sequence[JointHandle], place: str
) -> Constraints:
    stopped = _number(params, "stopped_velocity_tolerance", STOPPED_VELOCITY, place)
    path, goal = [], []
    for joint in joints:
        own, where = _tree(params, joint.name, place), f"{place}/{joint.name}"
        path.append(Tolerance(_number(own, "trajectory", 0.0, where)))
        goal.append(Tolerance(_number(own, "goal", 0.0, where), stopped))
    return Constraints(tuple(path), tuple(goal), _duration(params, "goal_time", place))


def _duration(params: Mapping[str, object], key: str, place: str) -> int:
    return round(min(max(0.0, _number(params, key, 0.0, place)), FOR_EVER) * NANOSECONDS)


def _tree(params: Mapping[str, object], key: str, place: str) -> Mapping[str, object]:
    tree = params.get(key, {})
    if not isinstance(tree, Mapping):
        raise ControlError(f"parameter {place}/{key} must hold parameters by name: {tree!r}")
    return tree


def _number(params: Mapping[str, object], key: str, default: float, place: str) -> float:
    return number_param(params, key, place) if key in params else default
