"""Joint limits on commands, as in joint_limits_interface.

See docs/contract/ros_control.md 5 and docs/contract/gazebo_ros_control.md 6.5.
"""

from collections.abc import Callable

from robot_sim.control.joint import JointHandle, JointLimits, SoftLimits
from robot_sim.state_dict import Stateful

Enforcer = Callable[[JointHandle], None]
UNLIMITED = float("inf")


def effort_enforcer(limits: JointLimits) -> Enforcer:
    """Returns a function that clips a joint's effort command in place, on each step."""
    if limits.effort is None and limits.velocity is None and limits.lower is None:
        return lambda joint: None
    if limits.soft is not None:
        return _soft_effort(limits, limits.soft)
    return _effort_saturation(limits)


def _effort_saturation(limits: JointLimits) -> Enforcer:
    """Allows full effort, but none that pushes further beyond an exceeded position or velocity limit."""
    effort = _or_unlimited(limits.effort)
    velocity = _or_unlimited(limits.velocity)
    lower = -UNLIMITED if limits.lower is None else limits.lower
    upper = _or_unlimited(limits.upper)

    def enforce(joint: JointHandle) -> None:
        command = joint.command
        if command < 0.0:
            if joint.position < lower or joint.velocity < -velocity:
                joint.command = 0.0
            elif command < -effort:
                joint.command = -effort
        elif joint.position > upper or joint.velocity > velocity:
            joint.command = 0.0
        elif command > effort:
            joint.command = effort

    return enforce


def _soft_effort(limits: JointLimits, soft: SoftLimits) -> Enforcer:
    """Reduces effort as the speed nears a bound that depends on the position (`<safety_controller>`)."""
    effort = _or_unlimited(limits.effort)

    def enforce(joint: JointHandle) -> None:
        slowest, fastest = _soft_speeds(limits, soft, joint.position)
        weakest = clamp(-soft.k_velocity * (joint.velocity - slowest), -effort, effort)
        strongest = clamp(-soft.k_velocity * (joint.velocity - fastest), -effort, effort)
        joint.command = clamp(joint.command, weakest, strongest)

    return enforce


class PositionLimiter(Stateful):
    """Clips a position command to the joint's range, and its change in a step to the velocity limit.

    Upstream never forgets the last command. Here a reset forgets it: otherwise the joint would creep back
    from where the reset has put it.
    """

    non_persistent = ("_limits",)

    def __init__(self, limits: JointLimits) -> None:
        self._limits = limits
        self._lower = -UNLIMITED if limits.lower is None else limits.lower
        self._upper = _or_unlimited(limits.upper)
        self._last: float | None = None

    def forget(self) -> None:
        """Lets the next command start from the joint's position."""
        self._last = None

    def limit(self, joint: JointHandle, dt: float) -> None:
        """Clips `joint.command` [rad, m] in place, `dt` [s] after the last call."""
        last = joint.position if self._last is None else self._last
        soft = self._limits.soft
        speed = _or_unlimited(self._limits.velocity)
        slowest, fastest = (-speed, speed) if soft is None else _soft_speeds(self._limits, soft, last)
        low = max(last + slowest * dt, self._lower)
        high = min(last + fastest * dt, self._upper)
        # If the joint is beyond its range the two bounds may cross: then the range counts.
        self._last = joint.command = clamp(clamp(joint.command, low, high), self._lower, self._upper)


class VelocityLimiter(Stateful):
    """Clips a velocity command to the velocity limit, and its change in a step to the acceleration limit."""

    non_persistent = ("_limits",)

    def __init__(self, limits: JointLimits) -> None:
        self._limits = limits
        self._speed = _or_unlimited(limits.velocity)
        self._last = 0.0

    def forget(self) -> None:
        """Lets the next command start from rest."""
        self._last = 0.0

    def limit(self, joint: JointHandle, dt: float) -> None:
        """Clips `joint.command` [rad/s, m/s] in place, `dt` [s] after the last call."""
        low, high = -self._speed, self._speed
        soft = self._limits.soft
        if soft is not None:
            low, high = _soft_speeds(self._limits, soft, joint.position)
        if self._limits.acceleration is not None:
            change = self._limits.acceleration * dt
            low, high = max(low, self._last - change), min(high, self._last + change)
        self._last = joint.command = clamp(joint.command, low, high)


def _soft_speeds(limits: JointLimits, soft: SoftLimits, position: float) -> tuple[float, float]:
    """Returns the lowest and highest velocity [rad/s, m/s] that soft limits allow at `position`."""
    speed = _or_unlimited(limits.velocity)
    if limits.lower is None or limits.upper is None:
        return -speed, speed
    return (
        clamp(-soft.k_position * (position - soft.lower), -speed, speed),
        clamp(-soft.k_position * (position - soft.upper), -speed, speed),
    )


def clamp(value: float, low: float, high: float) -> float:
    """Returns `value` within low..high; `low` if they cross."""
    return max(low, min(high, value))


def _or_unlimited(value: float | None) -> float:
    return UNLIMITED if value is None else value
