"""Placing one link of an articulated model as near to a pose as its joints allow.

Gazebo's links are free bodies, which joints pull back together; PyBullet's can't come apart. So the pose is
projected onto the joints that carry the link, and the velocity onto their speeds.
"""

import numpy as np

from robot_sim.physics.dynamics import jacobian
from robot_sim.physics.engine import Twist
from robot_sim.physics.model import Model
from robot_sim.physics.pose import Pose, rotation, subtract

ITERATIONS = 30
CLOSE = 1e-10  # [m, rad]; no smaller corrections are made
LONGEST = 0.5  # [rad] of a joint in one iteration: a linearised rotation is valid no further


def place_link(model: Model, link: str, pose: Pose, twist: Twist) -> None:
    """Moves `link` to the nearest pose (1 m counts as 1 rad) and velocity that its joints allow.

    The canonical link of a model with a free base moves the whole model. Other joints keep their values.
    """
    if link == model.description.root:
        if not model.description.fixed_base:
            model.body.reset_base(pose, twist)
        return
    carriers, before = model.carriers(link), model.joint_states()
    for _ in range(ITERATIONS):
        if _approach(model, carriers, link, pose) < CLOSE:
            break
    # The carriers' speeds by which the link's velocity comes nearest to `twist`.
    _speed_up(model, carriers, np.zeros(len(carriers)))
    _, rest = model.link_state(link)
    gap = np.array(twist[0] + twist[1]) - np.array(rest[0] + rest[1])
    speeds = np.linalg.lstsq(_jacobian(model, carriers, link), gap, rcond=1e-9)[0]
    _speed_up(model, carriers, speeds)
    model.put_followers()
    model.close_loops((), before)


def _approach(model: Model, carriers: list[str], link: str, pose: Pose) -> float:
    """One Gauss-Newton step of the carriers' positions; returns its length."""
    now, _ = model.link_state(link)
    gap = np.array(subtract(pose.position, now.position) + rotation(now, pose))
    correction = np.linalg.lstsq(_jacobian(model, carriers, link), gap, rcond=1e-9)[0]
    correction *= min(1.0, LONGEST / max(np.abs(correction).max(), 1e-300))
    moved = 0.0
    for name, change in zip(carriers, correction, strict=True):
        position, speed = model.joint_state(name)
        wanted = model.clamped(name, position + float(change))
        model.body.reset_joint(model.joint_index(name), wanted, speed)
        moved = max(moved, abs(wanted - position))
    return moved


def _jacobian(model: Model, carriers: list[str], link: str) -> np.ndarray:
    """Returns the link's velocity for unit speed of each carrier (6, n)."""
    joints = [model.description.joints[name] for name in carriers]
    poses = model.poses_by_link()
    return np.vstack(jacobian(model.description, joints, 0, poses, link, np.array(poses[link].position)))


def _speed_up(model: Model, carriers: list[str], speeds: np.ndarray) -> None:
    for name, speed in zip(carriers, speeds, strict=True):
        position, _ = model.joint_state(name)
        model.body.reset_joint(model.joint_index(name), position, float(speed))
