"""Rotation matrices and positions of poses."""

from collections.abc import Sequence

import numpy as np

from robot_sim.physics.pose import Pose


def frames(poses: Sequence[Pose]) -> tuple[np.ndarray, np.ndarray]:
    """Returns rotation matrices (n, 3, 3) and positions (n, 3) of poses."""
    turns = [_turn(*pose.orientation) for pose in poses]  # mostly few: NumPy would take ten times as long
    places = np.array([pose.position for pose in poses]).reshape(-1, 3)
    return np.array([*zip(*turns, strict=True)]).reshape(3, 3, -1).transpose(2, 0, 1), places


def _turn(x: float, y: float, z: float, w: float) -> tuple[float, ...]:
    """Returns the rotation matrix of a quaternion, row by row."""
    return (
        1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w),
        2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w),
        2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y),
    )  # fmt: skip
