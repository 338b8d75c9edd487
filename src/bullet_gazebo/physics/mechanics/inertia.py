"""Rigid-body inertia: combining bodies, by the parallel-axis theorem."""

import numpy as np

from bullet_gazebo.physics.description import Inertia
from bullet_gazebo.physics.pose import Pose, Quaternion, rotate


def combine(a: Inertia | None, b: Inertia | None) -> Inertia | None:
    """Returns the inertia of both bodies held together; both are given in the same frame."""
    bodies = [body for body in (a, b) if body is not None and body.mass > 0.0]
    if not bodies:
        return a or b
    if len(bodies) == 1:
        return bodies[0]
    mass = sum(body.mass for body in bodies)
    com = np.sum([body.mass * np.array(body.com.position) for body in bodies], axis=0) / mass
    tensor = np.sum([_about(body, com) for body in bodies], axis=0)
    return Inertia(
        mass, Pose((float(com[0]), float(com[1]), float(com[2]))),
        ixx=float(tensor[0, 0]), ixy=float(tensor[0, 1]), ixz=float(tensor[0, 2]),
        iyy=float(tensor[1, 1]), iyz=float(tensor[1, 2]), izz=float(tensor[2, 2]),
    )  # fmt: skip


def _about(body: Inertia, point: np.ndarray) -> np.ndarray:
    """The tensor (3, 3) about `point`, in the axes of the link."""
    rotation = _matrix(body.com.orientation)
    own = _tensor(body)
    arm = np.array(body.com.position) - point
    steiner = body.mass * (np.dot(arm, arm) * np.eye(3) - np.outer(arm, arm))
    return rotation @ own @ rotation.T + steiner


def _tensor(body: Inertia) -> np.ndarray:
    """The tensor (3, 3) about the centre of mass, in the axes of `com`."""
    return np.array(
        [
            [body.ixx, body.ixy, body.ixz],
            [body.ixy, body.iyy, body.iyz],
            [body.ixz, body.iyz, body.izz],
        ]
    )


def _matrix(q: Quaternion) -> np.ndarray:
    columns = [rotate(q, axis) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))]
    return np.array(columns).T


def is_positive_definite(inertia: Inertia) -> bool:
    """Returns whether mass and tensor are those of a body that an engine can turn about any axis."""
    return inertia.mass > 0.0 and bool(np.linalg.eigvalsh(_tensor(inertia)).min() > 0.0)


def tensor_in(inertia: Inertia, orientation: Quaternion) -> np.ndarray:
    """The tensor (3, 3) about the centre of mass, in the axes that `orientation` of the link is given in."""
    rotation = _matrix(orientation) @ _matrix(inertia.com.orientation)
    return rotation @ _tensor(inertia) @ rotation.T
