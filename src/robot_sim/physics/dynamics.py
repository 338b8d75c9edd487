"""Mechanics of an articulated model: inertias, link poses, and what an effort on a joint has to move."""

import math
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from robot_sim.physics.description import Inertia, Joint, ModelDescription
from robot_sim.physics.pose import Pose, Quaternion, rotate, scale


def combine(a: Inertia | None, b: Inertia | None) -> Inertia | None:
    """Returns the inertia of two bodies fixed to each other, by the parallel-axis theorem.

    Both are given in the same frame.
    """
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
    """Returns the tensor (3, 3) about `point`, in the axes of the link."""
    rotation = _matrix(body.com.orientation)
    own = _tensor(body)
    arm = np.array(body.com.position) - point
    steiner = body.mass * (np.dot(arm, arm) * np.eye(3) - np.outer(arm, arm))
    return rotation @ own @ rotation.T + steiner


def _tensor(body: Inertia) -> np.ndarray:
    """Returns the tensor (3, 3) about the centre of mass, in the axes of `com`."""
    return np.array(
        [[body.ixx, body.ixy, body.ixz], [body.ixy, body.iyy, body.iyz], [body.ixz, body.iyz, body.izz]]
    )


def _matrix(q: Quaternion) -> np.ndarray:
    columns = [rotate(q, axis) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))]
    return np.array(columns).T


def is_positive_definite(inertia: Inertia) -> bool:
    """Returns whether mass and tensor are positive (definite), so that a body can turn about any axis."""
    return inertia.mass > 0.0 and bool(np.linalg.eigvalsh(_tensor(inertia)).min() > 0.0)


def tensor_in(inertia: Inertia, orientation: Quaternion) -> np.ndarray:
    """Returns the tensor (3, 3) about the centre of mass, in the axes in which `orientation` is given.

    `orientation` is that of the link.
    """
    rotation = _matrix(orientation) @ _matrix(inertia.com.orientation)
    return rotation @ _tensor(inertia) @ rotation.T


def link_poses(model: ModelDescription, root: Pose, positions: Mapping[str, float]) -> dict[str, Pose]:
    """Returns the frame of every link, in the frame in which `root`, the root link's, is given.

    `positions` are those of the movable joints [rad, m]; a joint that isn't named is at zero.
    """
    poses = {model.root: root}
    poses.update({name: root.compose(pose) for name, pose in model.islands.items()})
    for joint in model.joints_below(*poses):
        moved = child_pose(joint, 0.0 if model.static else positions.get(joint.name, 0.0))
        poses[joint.child] = poses[joint.parent].compose(moved)
    return poses


def child_pose(joint: Joint, position: float) -> Pose:
    """Returns the child link seen from the parent, with the joint at `position` [rad, m]."""
    motion = Pose()
    if joint.kind == "prismatic":
        motion = Pose(scale(joint.axis, position))
    elif joint.movable and position != 0.0:
        x, y, z = scale(joint.axis, math.sin(position / 2.0))
        motion = Pose(orientation=(x, y, z, math.cos(position / 2.0)))
    return joint.pose.compose(joint.anchor).compose(motion).compose(joint.anchor.inverse())


def effective_inertias(model: ModelDescription, poses: Mapping[str, Pose]) -> dict[str, float]:
    """Returns effort / acceleration [kg m², kg] of each movable joint while all others are free.

    `poses` are those of the links in the world.
    """
    parts = np.diag(mobility(model, poses))
    return {
        joint.name: float(1.0 / part) if part > 0.0 else 0.0
        for joint, part in zip(model.movable_joints, parts, strict=True)
    }


def mobility(
    model: ModelDescription, poses: Mapping[str, Pose], added: Mapping[str, float] = MappingProxyType({})
) -> np.ndarray:
    """Returns the accelerations of the movable joints for unit efforts: the inverse mass matrix (n, n).

    `added` are inertias [kg m², kg] of the joints themselves, by name.
    """
    joints = model.movable_joints
    base = 0 if model.fixed_base or model.links[model.root].kinematic else 6
    matrix = np.zeros((base + len(joints), base + len(joints)))
    inertias = model.inertias()
    for name, pose in poses.items():
        inertia = inertias[name]
        if inertia is None:
            continue
        com = np.array(pose.compose(inertia.com).position)
        linear, angular = jacobian(model, joints, base, poses, name, com)
        tensor = tensor_in(inertia, pose.orientation)
        matrix += inertia.mass * linear.T @ linear + angular.T @ tensor @ angular
    for place, joint in enumerate(joints, start=base):
        matrix[place, place] += added.get(joint.name, 0.0)
    inverse: np.ndarray = np.linalg.pinv(matrix, hermitian=True)
    return inverse[base:, base:]


def poses_at_zero(model: ModelDescription) -> dict[str, Pose]:
    """Returns the poses of the links, seen from the root, with all joints at zero."""
    poses = {model.root: Pose()}
    for joint in model.joints_below(model.root):
        poses[joint.child] = poses[joint.parent].compose(joint.pose)
    return poses


def most_inertias(model: ModelDescription) -> dict[str, float]:
    """Returns the largest inertia [kg m², kg] that an effort on each movable joint has to move in any pose.

    It is that of all that the joint carries, stretched out.
    """
    below, inertias = model.joints_by_parent(), model.inertias()
    return {joint.name: _stretched(inertias, below, joint) for joint in model.movable_joints}


def _stretched(inertias: Mapping[str, Inertia | None], below: Mapping[str, list[Joint]], top: Joint) -> float:
    total, todo = 0.0, [(top.child, float(np.linalg.norm(top.anchor.position)))]
    for name, reach in todo:
        inertia = inertias[name]
        if inertia is not None:
            arm = reach + float(np.linalg.norm(inertia.com.position))
            turning = inertia.mass * arm**2 + max(inertia.ixx, inertia.iyy, inertia.izz)
            total += inertia.mass if top.kind == "prismatic" else turning
        todo.extend((j.child, reach + float(np.linalg.norm(j.pose.position))) for j in below[name])
    return total


def jacobian(
    model: ModelDescription,
    joints: list[Joint],
    base: int,
    poses: Mapping[str, Pose],
    link: str,
    point: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Returns linear velocity of `point` of `link`, and angular velocity, (3, base + joints) each."""
    linear, angular = np.zeros((2, 3, base + len(joints)))
    if base:
        linear[:, :3] = angular[:, 3:6] = np.eye(3)
        arm = point - np.array(poses[model.root].position)
        linear[:, 3:6] = np.cross(np.eye(3), arm).T
    carriers = {joint.name for joint in model.carriers(link)}
    for column, joint in enumerate(joints, start=base):
        if joint.name in carriers:
            linear[:, column], angular[:, column] = point_velocity(joint, poses[joint.child], point)
    return linear, angular


def point_velocity(joint: Joint, child: Pose, point: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns linear and angular velocity (3,) of a `point` that the joint moves at unit speed."""
    frame = child.compose(joint.anchor)
    axis = np.array(rotate(frame.orientation, joint.axis))
    if joint.kind == "prismatic":
        return axis, np.zeros(3)
    return np.cross(axis, point - np.array(frame.position)), axis
