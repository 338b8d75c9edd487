"""Service calls to the simulator, and results with several values. Part of `ros_gazebo`."""

import math
from typing import Any, NamedTuple, TypedDict, Unpack

import std_srvs.srv
from geometry_msgs.msg import Point, Pose, Quaternion, Twist
from std_msgs.msg import Header

from ros_calls import waiting
from ros_calls.service import ServiceFailed, ServiceHangs, ServiceMissing
from ros_utils._internal import log as _log


class SpawnResult(NamedTuple):
    """Whether a model was spawned, and the simulator's text or an earlier error."""

    success: bool
    status_message: str

    def __bool__(self) -> bool:
        return self.success


class ModelStateResult(NamedTuple):
    """A model's pose [m, quaternion] and twist [m/s, rad/s]; all zeros without success."""

    header: Header
    pose: Pose
    twist: Twist
    success: bool

    def __bool__(self) -> bool:
        return self.success


class LinkStateResult(NamedTuple):
    """A link's pose [m, quaternion] and twist [m/s, rad/s]; all zeros without success."""

    pose: Pose
    twist: Twist
    success: bool

    def __bool__(self) -> bool:
        return self.success


class JointPropertiesResult(NamedTuple):
    """A joint's position [rad, m] and velocity [rad/s, m/s]; zeros without success."""

    position: float
    rate: float
    success: bool

    def __bool__(self) -> bool:
        return self.success


class WorldPropertiesResult(NamedTuple):
    """The world's simulated time [s] and its models' names."""

    success: bool
    sim_time: float
    model_names: list[str]

    def __bool__(self) -> bool:
        return self.success


GAZEBO = "/gazebo"
TIMEOUT = waiting.TIMEOUT


class At(TypedDict, total=False):
    """The keywords of all functions that call the simulator: see `ros_gazebo`."""

    timeout: float
    gazebo_ns: str


def call(service: str, kind: Any, *request: Any, timeout: float = TIMEOUT, gazebo_ns: str = GAZEBO) -> Any:
    """Returns the simulator's answer, or None after a failure, which is logged."""
    name = f"{gazebo_ns.rstrip('/')}/{service}"
    try:
        answer = waiting.wait_and_call(name, kind, *request, timeout=timeout)
    except ServiceFailed as fault:
        _log.error(str(fault))
        return None
    if not getattr(answer, "success", True):
        _log.error(f"{name}: {answer.status_message}")
    return answer


def done(service: str, kind: Any, *request: Any, **at: Unpack[At]) -> bool:
    """Calls the simulator; returns whether it reports success."""
    return succeeded(call(service, kind, *request, **at))


def succeeded(answer: Any) -> bool:
    """Returns True if there is an answer and it reports success."""
    return answer is not None and bool(answer.success)


def empty_call(service: str, retries: int, timeout: float = TIMEOUT, gazebo_ns: str = GAZEBO) -> bool:
    """Calls a service without arguments until it succeeds, at most `retries` times."""
    name = f"{gazebo_ns.rstrip('/')}/{service}"
    for attempt in range(1, retries + 1):
        try:
            waiting.wait_and_call(name, std_srvs.srv.Empty, timeout=timeout)
            return True
        except (ServiceMissing, ServiceHangs) as fault:  # the wait was long enough: no retry
            _log.error(str(fault))
            return False
        except ServiceFailed as fault:
            _log.error(f"{fault} (attempt {attempt} of {retries})")
    return False


def make_pose(x: float, y: float, z: float, qx: float, qy: float, qz: float, qw: float) -> Pose:
    """Returns a pose; a quaternion that is all zeros means no rotation."""
    if not any((qx, qy, qz, qw)):
        qw = 1.0
    return Pose(position=Point(x, y, z), orientation=Quaternion(qx, qy, qz, qw))


def not_finite(what: str, *numbers: float) -> str:
    """Returns the fault if a number isn't finite, or an empty text."""
    if all(map(math.isfinite, numbers)):
        return ""
    return f"{what}: {list(numbers)} holds a number that is not finite"


def pose_numbers(pose: Pose) -> tuple[float, ...]:
    """Returns position and orientation of a pose as seven numbers."""
    p, q = pose.position, pose.orientation
    return (p.x, p.y, p.z, q.x, q.y, q.z, q.w)
