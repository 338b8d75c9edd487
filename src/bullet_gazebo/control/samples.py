"""What controllers report, as plain records; the ROS adapters turn them into messages."""

from typing import NamedTuple


class JointStateSample(NamedTuple):
    """sensor_msgs/JointState: positions [rad, m], velocities [rad/s, m/s], efforts [N m, N]."""

    stamp: int  # [ns]
    names: tuple[str, ...]
    positions: tuple[float, ...]
    velocities: tuple[float, ...]
    efforts: tuple[float, ...]


class JointControllerSample(NamedTuple):
    """control_msgs/JointControllerState; `error` is set_point - process_value."""

    stamp: int  # [ns]
    set_point: float
    process_value: float
    process_value_dot: float
    error: float
    time_step: float  # [s]
    command: float
    p: float
    i: float
    d: float
    i_clamp: float
    antiwindup: bool


class PidSample(NamedTuple):
    """control_msgs/PidState, without its header."""

    timestep: float  # [s]
    error: float
    error_dot: float
    p_error: float
    i_error: float
    d_error: float
    p_term: float
    i_term: float
    d_term: float
    i_max: float
    i_min: float
    output: float
