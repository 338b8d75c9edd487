"""The joint as controllers see it: state, command and limits (ros_control's joint handle)."""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class SoftLimits:
    """`<safety_controller>` of URDF: k_velocity [N s/m, N m s/rad], k_position [1/s]."""

    lower: float
    upper: float
    k_position: float
    k_velocity: float


@dataclass(frozen=True)
class JointLimits:
    """Limits of a joint; None where there is none. [rad, m], [rad/s, m/s], [N m, N]."""

    lower: float | None = None
    upper: float | None = None
    velocity: float | None = None
    effort: float | None = None
    soft: SoftLimits | None = None


@dataclass(slots=True)
class JointHandle:
    """One joint of the robot's hardware. `kind` is revolute, continuous or prismatic.

    `effort` is the effort [N m, N] applied in the last step; `command` is kept until it is replaced,
    also when its controller stops (ros_control.md section 1.6).
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
        if limits.lower is None or limits.upper is None:
            return position
        if position < limits.lower:
            return limits.lower
        return min(position, limits.upper)
