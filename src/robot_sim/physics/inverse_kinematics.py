"""Inverse kinematics: positions of an arm's joints that move its tip by a step."""

from collections.abc import Sequence
from itertools import accumulate

import numpy as np

from robot_sim.physics.description import Joint
from robot_sim.physics.dynamics import child_pose, point_velocity
from robot_sim.physics.pose import Pose, add, from_rpy, multiply, rotation, subtract

ITERATIONS = 30
DAMPING = 0.005  # [m/rad]: near a singularity an iteration moves no joint further than error / (2 DAMPING)
TURNING = 0.01  # [m] that a radian counts as: an arm with few joints moves straight, and turns as it must
CLOSE = 1e-5  # [rad, m]; no smaller corrections are made
LARGEST = 0.2  # [rad, m] that one step moves a joint


def step_tip(joints: Sequence[Joint], tip: Pose, start: np.ndarray, step: np.ndarray) -> np.ndarray | None:
    """Returns positions (n,) of an arm's joints [rad, m] that move its tip, by damped least squares.

    None if they can't do it within their limits; close to a singularity, those for a part of the step.

    Args:
        joints: The chain (n,); each one's `pose` is in the child before, the first one's in the base.
        tip: As seen from the last child.
        start: Positions (n,) from which it moves [rad, m].
        step: Along x, y, z of the base [m] and about z [rad]. Otherwise the tip turns as little as it can.
    """
    low, high = np.array([(each.clamped(-np.inf), each.clamped(np.inf)) for each in joints]).T
    x, y, z, about = step.tolist()
    now, stopped, goal = start, np.full(len(start), False), None
    for _ in range(ITERATIONS):
        children = list(accumulate(map(child_pose, joints, now.tolist()), Pose.compose))
        there = children[-1].compose(tip)
        if goal is None:
            goal = Pose(
                add(there.position, (x, y, z)), multiply(from_rpy(0.0, 0.0, about), there.orientation)
            )
        off, turn = np.array(subtract(goal.position, there.position)), np.array(rotation(there, goal))
        point = np.array(there.position)
        columns = [point_velocity(*each, point) for each in zip(joints, children, strict=True)]
        slopes = np.array([[*linear, *(TURNING * angular)] for linear, angular in columns]).T
        slopes[:, stopped] = 0.0
        square = slopes @ slopes.T + DAMPING**2 * np.eye(6)
        wanted = now + slopes.T @ np.linalg.solve(square, [*off, *(TURNING * turn)])
        if np.abs(wanted - now).max() < CLOSE:
            break
        now = np.clip(wanted, low, high)
        stopped |= now != wanted
    if np.linalg.norm(off) > 0.2 * np.linalg.norm(step[:3]) + 1e-4 or abs(turn[2]) > abs(about) / 2 > 0.0:
        return None
    change = now - start
    return np.asarray(start + change * min(1.0, LARGEST / max(np.abs(change).max(), LARGEST)))
