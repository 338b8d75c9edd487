"""What an effort on a joint has to move: the mass matrix of an articulated model where it stands."""

from collections import defaultdict
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from bullet_gazebo.physics.description import Joint, ModelDescription
from bullet_gazebo.physics.mechanics.inertia import tensor_in
from bullet_gazebo.physics.pose import Pose, rotate


def effective_inertias(model: ModelDescription, poses: Mapping[str, Pose]) -> dict[str, float]:
    """Returns for each movable joint effort / acceleration [kg m², kg], all other joints being free.

    `poses` are those of the links, in the world.
    """
    parts = np.diag(mobility(model, poses))
    return {
        joint.name: float(1.0 / part) if part > 0.0 else 0.0
        for joint, part in zip(model.movable_joints, parts, strict=True)
    }


def mobility(
    model: ModelDescription,
    poses: Mapping[str, Pose],
    added: Mapping[str, float] = MappingProxyType({}),
) -> np.ndarray:
    """Returns what accelerations of the movable joints (n, n) a unit of effort on one of them gives.

    `added` are inertias [kg m², kg] of joints themselves, by name.
    """
    joints = model.movable_joints
    base = 0 if model.fixed_base else 6
    matrix = np.zeros((base + len(joints), base + len(joints)))
    for name, pose in poses.items():
        inertia = model.links[name].inertia
        if inertia is None:
            continue
        com = np.array(pose.compose(inertia.com).position)
        linear, angular = _jacobian(model, joints, base, poses, name, com)
        tensor = tensor_in(inertia, pose.orientation)
        matrix += inertia.mass * linear.T @ linear + angular.T @ tensor @ angular
    for place, joint in enumerate(joints, start=base):
        matrix[place, place] += added.get(joint.name, 0.0)
    inverse: np.ndarray = np.linalg.pinv(matrix, hermitian=True)
    return inverse[base:, base:]


def poses_at_zero(model: ModelDescription) -> dict[str, Pose]:
    """Returns the poses of the links, seen from the root, with all joints at zero."""
    poses = {model.root: Pose()}
    below = defaultdict(list)
    for joint in model.joints.values():
        below[joint.parent].append(joint)
    todo = [model.root]
    for name in todo:
        for joint in below[name]:
            poses[joint.child] = poses[name].compose(joint.pose)
            todo.append(joint.child)  # the list grows while it is walked
    return poses


def most_inertias(model: ModelDescription) -> dict[str, float]:
    """Returns for each movable joint the inertia [kg m², kg] of all that it carries, stretched out: in no
    pose has an effort on it to move more."""
    below = defaultdict(list)
    for joint in model.joints.values():
        below[joint.parent].append(joint)
    return {joint.name: _stretched(model, below, joint) for joint in model.movable_joints}


def _stretched(model: ModelDescription, below: Mapping[str, list[Joint]], top: Joint) -> float:
    total, todo = 0.0, [(top.child, float(np.linalg.norm(top.anchor.position)))]
    for name, reach in todo:
        inertia = model.links[name].inertia
        if inertia is not None:
            arm = reach + float(np.linalg.norm(inertia.com.position))
            turning = inertia.mass * arm**2 + max(inertia.ixx, inertia.iyy, inertia.izz)
            total += inertia.mass if top.kind == "prismatic" else turning
        todo.extend((j.child, reach + float(np.linalg.norm(j.pose.position))) for j in below[name])
    return total


def _jacobian(
    model: ModelDescription,
    joints: list[Joint],
    base: int,
    poses: Mapping[str, Pose],
    link: str,
    point: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Linear velocity of `point` of `link` and angular velocity, (3, base + joints) each."""
    linear, angular = np.zeros((2, 3, base + len(joints)))
    if base:
        linear[:, :3] = angular[:, 3:6] = np.eye(3)
        arm = point - np.array(poses[model.root].position)
        linear[:, 3:6] = np.cross(np.eye(3), arm).T
    carriers = _carriers(model, link)
    for column, joint in enumerate(joints, start=base):
        if joint.name not in carriers:
            continue
        frame = poses[joint.child].compose(joint.anchor)
        axis = np.array(rotate(frame.orientation, joint.axis))
        if joint.kind == "prismatic":
            linear[:, column] = axis
        else:
            linear[:, column] = np.cross(axis, point - np.array(frame.position))
            angular[:, column] = axis
    return linear, angular


def _carriers(model: ModelDescription, link: str) -> set[str]:
    parents = {joint.child: joint for joint in model.joints.values()}
    found = set()
    while link in parents:
        found.add(parents[link].name)
        link = parents[link].parent
    return found
