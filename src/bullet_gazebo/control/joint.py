"""The joint as controllers see it: state, command and limits (ros_control's joint handle)."""

from dataclasses import dataclass, field

from bullet_gazebo.control.angles import shortest_distance, shortest_distance_within


@dataclass(frozen=True)
class SoftLimits:
    """`<safety_controller>` of URDF: k_velocity [N s/m, N m s/rad], k_position [1/s]."""

    lower: float
    upper: float
    k_position: float
    k_velocity: float


@dataclass(frozen=True)
class JointLimits:
    """Limits of a joint; None where there is none. [rad, m] and their derivatives, [N m, N]."""

    lower: float | None = None
    upper: float | None = None
    velocity: float | None = None
    effort: float | None = None
    soft: SoftLimits | None = None
    acceleration: float | None = None


@dataclass(slots=True)
class JointHandle:
    """One joint of the robot's hardware. `kind` is revolute, continuous or prismatic.

    `command` is a position, a velocity or an effort, as the joint's hardware interface has it. It is
    kept until it is replaced, also when its controller stops (docs/contract/ros_control.md 1.6).
    `effort` is the effort [N m, N] applied in the last step.
    """

    name: str
    kind: str
    limits: JointLimits = field(default_factory=JointLimits)
    position: float = 0.0
    velocity: float = 0.0
    effort: float = 0.0
    command: float = 0.0

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
        """Returns the way from here to `position` [rad, m] (docs/contract/ros_control.md 3.2).

        For an angle it is the shortest turn, within the limits of a revolute joint.
        """
        if self.kind == "prismatic":
            return position - self.position
        limits = self.limits
        if self.kind == "revolute" and limits.lower is not None and limits.upper is not None:
            return shortest_distance_within(self.position, position, limits.lower, limits.upper)
        return shortest_distance(self.position, position)
