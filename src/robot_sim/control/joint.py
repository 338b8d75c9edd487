"""A joint as controllers see it: state, command and limits (ros_control's joint handle)."""

import math
from dataclasses import dataclass, field

from robot_sim.state_dict import Shared, Stateful

TURN = 2.0 * math.pi


def normalized(angle: float) -> float:
    """Returns `angle` [rad] in (-pi, pi]."""
    if -math.pi < angle <= math.pi:  # nearly always true, and several times faster than fmod
        return angle
    angle = math.fmod(angle + math.pi, TURN)
    return angle + math.pi if angle <= 0.0 else angle - math.pi


def shortest_distance(start: float, end: float) -> float:
    """Returns the shortest turn [rad] from `start` to `end`; exactly half a turn is positive."""
    return normalized(end - start)


def shortest_distance_within(start: float, end: float, lower: float, upper: float) -> float:
    """Returns the shortest turn from `start` to `end` that stays within [lower, upper].

    If neither direction does, it returns the shorter one, as upstream does when a joint has left its limits.
    """
    short = shortest_distance(start, end)
    for turn in (short, short - math.copysign(TURN, short)):
        if lower - 1e-9 <= start + turn <= upper + 1e-9:
            return turn
    return short


@dataclass(frozen=True)
class SoftLimits:
    """`<safety_controller>` of URDF: k_velocity [N s/m, N m s/rad], k_position [1/s]."""

    lower: float
    upper: float
    k_position: float
    k_velocity: float


@dataclass(frozen=True)
class JointLimits:
    """Limits of a joint [rad, m] and their derivatives, [N m, N]; None if there is no limit."""

    lower: float | None = None
    upper: float | None = None
    velocity: float | None = None
    effort: float | None = None
    soft: SoftLimits | None = None
    acceleration: float | None = None


@dataclass(slots=True)
class JointHandle(Shared, Stateful):
    """One joint of the robot's hardware. `kind` is revolute, continuous or prismatic.

    `command` is a position, a velocity or an effort, depending on the joint's hardware interface. It
    remains until it is replaced, also when its controller stops (docs/contract/ros_control.md 1.6).
    `effort` is the effort [N m, N] applied in the last step.
    """

    non_persistent = ("name", "kind", "limits")

    name: str
    kind: str
    limits: JointLimits = field(default_factory=JointLimits)
    position: float = 0.0
    velocity: float = 0.0
    effort: float = 0.0
    command: float = 0.0

    @property
    def identity(self) -> str:
        return self.name

    def clamped(self, position: float) -> float:
        """Returns `position` within the limits of a revolute or prismatic joint."""
        limits = self.limits
        lower, upper = limits.lower, limits.upper
        if lower is None or upper is None:
            return position
        if position < lower:
            return lower
        return upper if upper < position else position

    def way_to(self, position: float) -> float:
        """Returns the difference from the present position to `position` [rad, m].

        For an angle it is the shortest turn, within the limits of a revolute joint
        (docs/contract/ros_control.md 3.2).
        """
        way = position - self.position
        if self.kind == "prismatic":
            return way
        limits = self.limits
        if self.kind == "revolute" and limits.lower is not None and limits.upper is not None:
            if -math.pi < way <= math.pi and limits.lower <= position <= limits.upper:  # nearly always true
                return way
            return shortest_distance_within(self.position, position, limits.lower, limits.upper)
        return normalized(way)
