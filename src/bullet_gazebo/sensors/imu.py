"""Inertial measurement units (docs/contract/sensors.md 3)."""

from typing import NamedTuple

import numpy as np

from bullet_gazebo.physics.model import Model
from bullet_gazebo.physics.pose import (
    Pose,
    Quaternion,
    Vector,
    add,
    conjugate,
    cross,
    rotate,
    scale,
    subtract,
)

NANOSECONDS = 1_000_000_000
HERE = Pose()
LONGEST_STEP = 0.01  # [s]


class LinkMotion(NamedTuple):
    """Where a frame is in the world, and how fast [m/s], [rad/s], in world axes."""

    pose: Pose
    linear: Vector
    angular: Vector


class InertialSample(NamedTuple):
    """What an IMU measures, in its own axes: angular velocity [rad/s], linear acceleration [m/s²]."""

    orientation: Quaternion  # of the sensor in the world
    angular_velocity: Vector
    linear_acceleration: Vector


def motion_of(model: Model, link: str, offset: Pose = HERE) -> LinkMotion:
    """Returns the motion of the frame at `offset` in a link."""
    pose, (linear, angular) = model.link_state(link)
    at = pose.compose(offset)
    lever = subtract(at.position, pose.position)
    return LinkMotion(at, add(linear, cross(angular, lever)), angular)


class Imu:
    """Derives accelerations from the velocities of two measurements.

    Args:
        feels_gravity: whether it measures +9.8 m/s² upwards at rest, as real ones do.
        rate: of the measurements [Hz]; 0 is every step. An older one is not compared with.
    """

    def __init__(self, feels_gravity: bool, rate: float = 0.0) -> None:
        self._feels_gravity = feels_gravity
        self._longest = 1.5 * NANOSECONDS * max(1.0 / rate if rate else 0.0, LONGEST_STEP)  # [ns]
        self._last: tuple[int, int, Vector] | None = None  # time [ns], moves, velocity [m/s]

    def measure(
        self, now: int, moves: int, motion: LinkMotion, gravity: Vector
    ) -> InertialSample | None:
        """Returns a measurement; None for the first one, which has none to compare with.

        Args:
            now: time [ns].
            moves: counts what has moved bodies besides time: across such a move there is no acceleration.
            motion: of the sensor.
            gravity: of the world [m/s²].
        """
        last, self._last = self._last, (now, moves, motion.linear)
        if last is None or (last[1] == moves and now - last[0] > self._longest):
            return None
        acceleration: Vector = (0.0, 0.0, 0.0)
        if moves == last[1] and now > last[0]:
            seconds = (now - last[0]) / NANOSECONDS
            acceleration = scale(subtract(motion.linear, last[2]), 1.0 / seconds)
        if self._feels_gravity:
            acceleration = subtract(acceleration, gravity)
        back = conjugate(motion.pose.orientation)
        return InertialSample(
            motion.pose.orientation, rotate(back, motion.angular), rotate(back, acceleration)
        )


def with_noise(
    sample: InertialSample, deviation: float, random: np.random.Generator
) -> InertialSample:
    """Adds Gaussian noise of one deviation to all ten numbers; the quaternion keeps its length of 1."""
    if not deviation:
        return sample
    noisy = [
        [
            value + draw
            for value, draw in zip(part, random.normal(0.0, deviation, len(part)), strict=True)
        ]
        for part in sample
    ]
    length = float(np.linalg.norm(noisy[0]))
    x, y, z, w = (value / length for value in noisy[0])
    (p, q, r), (u, v, s) = noisy[1:]
    return InertialSample((x, y, z, w), (p, q, r), (u, v, s))
