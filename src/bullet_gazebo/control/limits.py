"""Joint limits on effort commands (joint_limits_interface; ros_control.md section 5)."""

from collections.abc import Callable

from bullet_gazebo.control.joint import JointHandle, JointLimits, SoftLimits

Enforcer = Callable[[JointHandle], None]
UNLIMITED = float("inf")


def effort_enforcer(limits: JointLimits) -> Enforcer | None:
    """Returns what clips a joint's effort command in place on each step; None if nothing is limited."""
    if limits.effort is None and limits.velocity is None and limits.lower is None:
        return None
    if limits.soft is not None:
        return _soft(limits, limits.soft)
    return _saturation(limits)


def _saturation(limits: JointLimits) -> Enforcer:
    """Full effort, but none that pushes further beyond an exceeded position or velocity limit."""
    effort = UNLIMITED if limits.effort is None else limits.effort
    velocity = UNLIMITED if limits.velocity is None else limits.velocity
    lower = -UNLIMITED if limits.lower is None else limits.lower
    upper = UNLIMITED if limits.upper is None else limits.upper

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


def _soft(limits: JointLimits, soft: SoftLimits) -> Enforcer:
    """The windows of `<safety_controller>`: effort falls off as speed nears its position-dependent bound."""
    effort = UNLIMITED if limits.effort is None else limits.effort
    speed = UNLIMITED if limits.velocity is None else limits.velocity
    bounded = limits.lower is not None and limits.upper is not None

    def enforce(joint: JointHandle) -> None:
        slowest, fastest = -speed, speed
        if bounded:
            slowest = _clamp(-soft.k_position * (joint.position - soft.lower), -speed, speed)
            fastest = _clamp(-soft.k_position * (joint.position - soft.upper), -speed, speed)
        weakest = _clamp(-soft.k_velocity * (joint.velocity - slowest), -effort, effort)
        strongest = _clamp(-soft.k_velocity * (joint.velocity - fastest), -effort, effort)
        joint.command = _clamp(joint.command, weakest, strongest)

    return enforce


def _clamp(value: float, low: float, high: float) -> float:
    return max(low, min(high, value))
