"""Wheel kinematics: a vehicle's velocity, its wheels' velocities, and their limits."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from robot_sim.state_dict import Stateful

NEAR = 0.01  # [m/s]; of its target a wheel counts as there


def side_speeds(linear: float, angular: float, separation: float) -> tuple[float, float]:
    """Returns the speeds [m/s] of the left and right wheels for a velocity [m/s, rad/s], anticlockwise."""
    across = 0.5 * angular * separation
    return linear - across, linear + across


class Ramp(Stateful):
    """Lets the speeds of wheels change by no more than an acceleration [m/s²]; 0 is none."""

    def __init__(self, acceleration: float, wheels: int) -> None:
        self._acceleration = acceleration
        self._issued = [0.0] * wheels

    def restart(self) -> None:
        """Begins from rest."""
        self._issued = [0.0] * len(self._issued)

    def next(self, targets: Sequence[float], measured: Sequence[float], seconds: float) -> list[float]:
        """Returns the speeds to issue, given the wanted and the measured ones [m/s], each some time [s]."""
        gaps = [target - speed for target, speed in zip(targets, measured, strict=True)]
        if self._acceleration <= 0.0 or any(abs(gap) < NEAR for gap in gaps):
            return list(targets)
        most = self._acceleration * seconds
        for wheel, (gap, target) in enumerate(zip(gaps, targets, strict=True)):
            speed = self._issued[wheel] + max(-most, min(most, gap))
            self._issued[wheel] = min(speed, target) if gap > 0.0 else max(speed, target)
        return list(self._issued)


@dataclass(frozen=True)
class SpeedLimits:
    """Limits of a velocity and of its derivatives, each a least and a most one; None: no limit."""

    velocity: tuple[float, float] | None = None
    acceleration: tuple[float, float] | None = None
    jerk: tuple[float, float] | None = None

    def limited(self, speed: float, last: float, before: float, dt: float) -> float:
        """Returns the speed to command instead of `speed`; `last` was `dt` [s] ago, `before` twice that."""
        if self.jerk is not None:
            low, high = self.jerk
            change = last - before
            step = speed - last - change
            speed = last + change + max(2.0 * low * dt * dt, min(2.0 * high * dt * dt, step))
        if self.acceleration is not None:
            low, high = self.acceleration
            speed = last + max(low * dt, min(high * dt, speed - last))
        if self.velocity is not None:
            low, high = self.velocity
            speed = max(low, min(high, speed))
        return speed


@dataclass(frozen=True)
class Steering:
    """Speeds [m/s] and angles [rad] of a vehicle's wheels: front left, front right, rear left, rear right."""

    speeds: tuple[float, ...]
    angles: tuple[float, ...]


@dataclass(frozen=True)
class SteeredWheels:
    """Four wheels that steer about pivots at the corners of a rectangle around the vehicle's centre."""

    base: float  # [m] from the rear pivots to the front ones
    track: float  # [m] between the pivots of an axle
    offset: float = 0.0  # [m] from a pivot to its wheel, outwards

    @property
    def _pivots(self) -> list[tuple[float, float]]:
        x, y = 0.5 * self.base, 0.5 * self.track
        return [(x, y), (x, -y), (-x, y), (-x, -y)]

    def steering(self, ahead: float, left: float, turn: float) -> Steering:
        """Returns what the wheels do for a velocity of the centre [m/s, m/s, rad/s] to be rolled.

        Angles are within a quarter turn; a wheel that has to go backwards has a negative speed.
        """
        speeds, angles = [], []
        for x, y in self._pivots:
            along, across = ahead - turn * y, left + turn * x
            angle = math.atan2(across, along)
            speed = math.hypot(along, across)
            if abs(angle) > 0.5 * math.pi or (along == 0.0 and ahead < 0.0):
                angle, speed = angle - math.copysign(math.pi, angle), -speed
            # A wheel outside its pivot goes round it, on a larger circle or a smaller one.
            speeds.append(speed - math.copysign(self.offset, y) * turn)
            angles.append(angle)
        return Steering(tuple(speeds), tuple(angles))

    def velocity(self, steering: Steering) -> tuple[float, float, float]:
        """Returns the centre's velocity [m/s, m/s, rad/s] that comes nearest to rolling wheels."""
        wheels = list(zip(self._pivots, steering.speeds, steering.angles, strict=True))
        levers = [x * math.sin(angle) - y * math.cos(angle) for (x, y), _, angle in wheels]
        # What each pivot moves by along its wheel is the wheel's speed and `outside` times the turn.
        outside = [math.copysign(self.offset, y) for (_, y), _, _ in wheels]
        moments = math.fsum(lever * speed for lever, (_, speed, _) in zip(levers, wheels, strict=True))
        inertia = self.base**2 + self.track**2
        inertia -= math.fsum(lever * arm for lever, arm in zip(levers, outside, strict=True))
        turn = moments / inertia
        ahead = left = 0.0
        for arm, (_, speed, angle) in zip(outside, wheels, strict=True):
            ahead += 0.25 * (speed + arm * turn) * math.cos(angle)
            left += 0.25 * (speed + arm * turn) * math.sin(angle)
        return ahead, left, turn
