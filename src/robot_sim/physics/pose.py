"""Rigid-body poses: position [m] and unit quaternion (x, y, z, w), the order of ROS and PyBullet."""

import math
from typing import NamedTuple

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]

ZERO: Vector = (0.0, 0.0, 0.0)
IDENTITY: Quaternion = (0.0, 0.0, 0.0, 1.0)


class Pose(NamedTuple):
    """A frame seen from another one."""

    position: Vector = ZERO
    orientation: Quaternion = IDENTITY

    def compose(self, child: "Pose") -> "Pose":
        """Returns `child`, given in this frame, in the frame that this pose is given in."""
        return Pose(
            add(self.position, rotate(self.orientation, child.position)),
            multiply(self.orientation, child.orientation),
        )

    def inverse(self) -> "Pose":
        """Returns the outer frame seen from this one."""
        back = conjugate(self.orientation)
        return Pose(scale(rotate(back, self.position), -1.0), back)

    def relative_to(self, frame: "Pose") -> "Pose":
        """Returns this pose as seen from `frame`, both being given in the same outer frame."""
        return frame.inverse().compose(self)


def add(a: Vector, b: Vector) -> Vector:
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def subtract(a: Vector, b: Vector) -> Vector:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def scale(a: Vector, factor: float) -> Vector:
    return (a[0] * factor, a[1] * factor, a[2] * factor)


def cross(a: Vector, b: Vector) -> Vector:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def conjugate(q: Quaternion) -> Quaternion:
    return (-q[0], -q[1], -q[2], q[3])


def multiply(a: Quaternion, b: Quaternion) -> Quaternion:
    """Hamilton product: the rotation `b` followed by `a`."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def rotate(q: Quaternion, v: Vector) -> Vector:
    """Rotates `v` by the unit quaternion `q`."""
    axis = (q[0], q[1], q[2])
    twice = scale(cross(axis, v), 2.0)
    return add(add(v, scale(twice, q[3])), cross(axis, twice))


def normalized(q: Quaternion) -> Quaternion:
    """Scales `q` to unit length; all zeros, a default-constructed message, means no rotation."""
    length = math.sqrt(sum(c * c for c in q))
    if length < 1e-12:
        return IDENTITY
    return (q[0] / length, q[1] / length, q[2] / length, q[3] / length)


def z_onto(direction: tuple[float, ...]) -> Quaternion:
    """Returns the shortest rotation of z onto a direction of any length above 0."""
    x, y, z = direction
    length = (x * x + y * y + z * z) ** 0.5
    if z < -0.999999 * length:
        return (1.0, 0.0, 0.0, 0.0)
    return normalized((0.0 - y, x, 0.0, length + z))


def from_rpy(roll: float, pitch: float, yaw: float) -> Quaternion:
    """Returns the quaternion of fixed-axis roll, pitch, yaw [rad], the convention of URDF."""
    cr, sr = math.cos(roll / 2), math.sin(roll / 2)
    cp, sp = math.cos(pitch / 2), math.sin(pitch / 2)
    cy, sy = math.cos(yaw / 2), math.sin(yaw / 2)
    return (
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    )


def to_rpy(q: Quaternion) -> Vector:
    """Returns fixed-axis roll, pitch, yaw [rad] of the unit quaternion `q`."""
    x, y, z, w = q
    roll = math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    pitch = math.asin(max(-1.0, min(1.0, 2 * (w * y - z * x))))
    yaw = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return (roll, pitch, yaw)


def is_finite(pose: Pose) -> bool:
    return all(math.isfinite(c) for c in pose.position + pose.orientation)


def rotation(now: Pose, wanted: Pose) -> Vector:
    """Returns the shortest rotation [rad], a vector in outer axes, from `now` to `wanted`."""
    x, y, z, w = multiply(wanted.orientation, conjugate(now.orientation))
    length = math.sqrt(x * x + y * y + z * z)
    if length < 1e-15:
        return ZERO
    angle = 2.0 * math.atan2(length, abs(w)) * math.copysign(1.0, w)
    return (x / length * angle, y / length * angle, z / length * angle)
