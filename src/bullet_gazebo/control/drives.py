"""How a position or velocity command moves a joint (docs/contract/gazebo_ros_control.md 6.4)."""

import math
from abc import ABC, abstractmethod

from bullet_gazebo.control.joint import JointHandle
from bullet_gazebo.control.limits import UNLIMITED, PositionLimiter, VelocityLimiter, clamp
from bullet_gazebo.control.pid import Pid


class Drive(ABC):
    """One joint with a position or a velocity interface.

    `pid` turns commands into efforts; without one a motor drives the joint to the commanded state.
    """

    def __init__(self, joint: JointHandle, pid: Pid | None) -> None:
        self.joint = joint
        self.pid = pid
        limit = joint.limits.effort
        self._most = UNLIMITED if limit is None else limit
        speed = joint.limits.velocity
        self._fastest = UNLIMITED if speed is None else speed

    @abstractmethod
    def relatch(self) -> None:
        """Takes the joint's present state for what is commanded, and forgets the past."""

    def begin_hold(self) -> None:
        """Called when an emergency stop begins."""

    @abstractmethod
    def hold(self) -> None:
        """What an emergency stop commands, on each step."""

    @abstractmethod
    def limit(self, dt: float) -> None:
        """Clips the command in place; `dt` [s] is the step."""

    @abstractmethod
    def effort(self, dt: float) -> float:
        """Returns the effort [N m, N] of the PID for a step of `dt` [s]."""

    @abstractmethod
    def motor(self, dt: float) -> tuple[float, float]:
        """Returns speed [rad/s, m/s] and most effort [N m, N] of the motor for a step of `dt` [s]."""

    def _clipped(self, error: float, dt: float) -> float:
        """The PID's effort within the limit, and none that speeds a joint up beyond its velocity limit."""
        assert self.pid is not None
        effort = clamp(self.pid.compute(error, dt), -self._most, self._most)
        speed = self.joint.velocity
        return 0.0 if abs(speed) > self._fastest and speed * effort > 0.0 else effort


class PositionDrive(Drive):
    """Commands are positions [rad, m].

    Gazebo sets the joint's position at each step. Here a motor takes it there within the step, which
    is the same for the joint, and right for what it carries and touches.
    """

    def __init__(self, joint: JointHandle, pid: Pid | None) -> None:
        super().__init__(joint, pid)
        self._limiter = PositionLimiter(joint.limits)
        self._held = joint.position
        self._good = joint.position

    def relatch(self) -> None:
        self._held = self._good = self.joint.command = self.joint.position
        self._limiter.forget()
        if self.pid is not None:
            self.pid.clear()

    def begin_hold(self) -> None:
        self._held = self.joint.position

    def hold(self) -> None:
        self.joint.command = self._held

    def limit(self, dt: float) -> None:
        if not math.isfinite(self.joint.command):
            self.joint.command = self._good
        self._limiter.limit(self.joint, dt)
        self._good = self.joint.command

    def effort(self, dt: float) -> float:
        return self._clipped(self.joint.way_to(self.joint.command), dt)

    def motor(self, dt: float) -> tuple[float, float]:
        return (self.joint.command - self.joint.position) / dt, UNLIMITED


class VelocityDrive(Drive):
    """Commands are velocities [rad/s, m/s]."""

    def __init__(self, joint: JointHandle, pid: Pid | None) -> None:
        super().__init__(joint, pid)
        self._limiter = VelocityLimiter(joint.limits)

    def relatch(self) -> None:
        self.joint.command = 0.0
        self._limiter.forget()
        if self.pid is not None:
            self.pid.clear()

    def hold(self) -> None:
        self.joint.command = 0.0

    def limit(self, dt: float) -> None:
        if not math.isfinite(self.joint.command):
            self.joint.command = 0.0
        self._limiter.limit(self.joint, dt)

    def effort(self, dt: float) -> float:
        return self._clipped(self.joint.command - self.joint.velocity, dt)

    def motor(self, dt: float) -> tuple[float, float]:
        return self.joint.command, self._most
