"""Wheel odometry, and its publishing period (docs/contract/sensors.md 1 and 7)."""

import math
from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

from robot_sim.constants import NANOSECONDS
from robot_sim.state_dict import Stateful

Triple = tuple[float, float, float]
STRAIGHT = 1e-6  # [rad]; below it an arc is a line
SLOWEST = 1e-9  # [Hz]
UNKNOWN = 1e12  # the variance of what is not measured
POSE = (1e-5, 1e-5, UNKNOWN, UNKNOWN, UNKNOWN, 1e-3)  # covariances of most plugins
TWIST = (0.0,) * 6


class OdometrySample(NamedTuple):
    """nav_msgs/Odometry: pose in `frame` [m] and twist in the axes of `child` [m/s, rad/s].

    The covariances are diagonals: x, y, z, and turns about them.
    """

    stamp: int  # [ns]
    frame: str
    child: str
    position: Triple
    orientation: tuple[float, float, float, float]
    linear: Triple
    angular: Triple
    pose_covariance: Sequence[float]
    twist_covariance: Sequence[float]


class DeadReckoning(Stateful):
    """Adds up a vehicle's motions on a plane, from x = y = yaw = 0."""

    def __init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        """Returns to the origin."""
        self.x = self.y = self.yaw = 0.0

    def move(self, ahead: float, turn: float, left: float = 0.0) -> None:
        """Adds a motion in the vehicle's axes [m, rad, m], in the direction half-way through its turn."""
        middle = self.yaw + 0.5 * turn
        cosine, sine = math.cos(middle), math.sin(middle)
        self.x += ahead * cosine - left * sine
        self.y += ahead * sine + left * cosine
        self.yaw += turn

    def move_on_arc(self, ahead: float, turn: float, left: float = 0.0) -> None:
        """Adds a motion as `move`, along an arc of that length."""
        half = 0.5 * turn  # the chord of the arc has the direction half-way
        share = 1.0 if abs(turn) < STRAIGHT else math.sin(half) / half
        self.move(share * ahead, turn, share * left)

    @property
    def position(self) -> Triple:
        """In the frame of the odometry [m]."""
        return (self.x, self.y, 0.0)

    @property
    def orientation(self) -> tuple[float, float, float, float]:
        """In the frame of the odometry, as a quaternion x, y, z, w."""
        return (0.0, 0.0, math.sin(0.5 * self.yaw), math.cos(0.5 * self.yaw))


class WheelOdometry(Stateful):
    """Dead reckoning of two wheels or sides with a separation [m], step by step."""

    def __init__(self, separation: float) -> None:
        self._separation = separation
        self.place = DeadReckoning()
        self.linear = self.angular = 0.0  # [m/s, rad/s]

    def restart(self) -> None:
        """Returns to the origin, at rest."""
        self.place.restart()
        self.linear = self.angular = 0.0

    def step(self, speeds: Sequence[float], seconds: float) -> None:
        """Adds the motion of a step of that length [s], at the speeds of both wheels [m/s]."""
        left, right = speeds
        self.linear, self.angular = 0.5 * (left + right), (right - left) / self._separation
        self.place.move(self.linear * seconds, self.angular * seconds)

    def sample(self, now: int, frame: str, child: str) -> OdometrySample:
        """Returns the odometry at a time [ns]."""
        return OdometrySample(
            now, frame, child, self.place.position, self.place.orientation,
            (self.linear, 0.0, 0.0), (0.0, 0.0, self.angular), POSE, TWIST,
        )  # fmt: skip


class RollingMean(Stateful):
    """The mean of the newest values, at most `window` of them."""

    def __init__(self, window: int) -> None:
        self._values: deque[float] = deque(maxlen=max(window, 1))
        self._sum = 0.0

    def add(self, value: float) -> float:
        """Returns the mean with a new value."""
        values = self._values
        if len(values) == values.maxlen:
            self._sum -= values[0]
        values.append(value)
        self._sum += value
        return self._sum / len(values)

    def clear(self) -> None:
        self._values.clear()
        self._sum = 0.0


class Period(Stateful):
    """Says once a period that something is due.

    Args:
        rate: In Hz of simulated time; 0 is every step.
        now: Time [ns] at which the first period begins.
        late: Whether a period has to be over, so that the first step is one behind it.
    """

    def __init__(self, rate: float, now: int, late: bool = False) -> None:
        self._late = int(late)
        self.set_rate(rate)
        self.restart(now)

    def set_rate(self, rate: float) -> None:
        """Lets the next periods be as long as a rate says [Hz]."""
        self._length = round(NANOSECONDS / max(rate, SLOWEST)) if rate > 0.0 else 0

    def restart(self, now: int) -> None:
        """Lets a period begin at `now` [ns]."""
        self._due = now + self._length + self._late

    def time_set_back(self, now: int) -> None:
        """Makes the next one due within a period, as at `now` [ns] time was set back or the rate is new."""
        self._due = min(self._due, now + self._length + self._late)

    def is_over(self, now: int) -> bool:
        """Whether something is due at `now` [ns]; if so, the next period begins where it ended."""
        if now < self._due:
            return False
        self._due = max(self._due + self._length, now - self._length + self._late)
        return True
