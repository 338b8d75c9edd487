"""Closed loops of joints: a spanning tree with welds for the engines, and positions that close the loops.

What fixed joints join is one body: they are in the tree first, with either end as the parent. A joint that
closes a loop carries a helper link of its own, which the engines weld to the joint's child and give a share
of the child's inertia. So it is a joint like any other, with a position, stops, damping and motors.
"""

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from robot_sim.physics.description import BALL, DescriptionError, Joint, Link, ModelDescription
from robot_sim.physics.dynamics import jacobian, link_poses
from robot_sim.physics.lumping import check_links
from robot_sim.physics.pose import Pose, rotation, scale, subtract

ITERATIONS = 50
CLOSE = 1e-9  # [m, rad]
LONGEST = 0.2  # [rad, m] of a joint in one step: a linearised rotation is valid no further
MOST_STEPS = 100
States = dict[str, tuple[float, float]]  # position [rad, m] and velocity [rad/s, m/s] by joint


def span(links: dict[str, Link], joints: dict[str, Joint], warnings: list[str]) -> list[str]:
    """Makes trees of links and joints, in place; returns their roots.

    A root is the first link that no joint carries. Of the joints to a link the first one is in the tree.
    A joint of a kind that isn't simulated may close a loop, with a warning unless it is a ball joint.
    """
    check_links(links, joints)
    first: dict[str, str] = {}
    for joint in joints.values():
        first.setdefault(joint.child, joint.name)
    parts = {name: [name] for name in links}  # the links that are joined to each one
    tree: dict[str, list[str]] = {name: [] for name in links}
    for joint in sorted(
        joints.values(),
        key=lambda each: (each.kind != "fixed", not each.movable, first[each.child] != each.name),
    ):
        one, other = parts[joint.parent], parts[joint.child]
        if one is other:
            _close(links, joints, joint, warnings)
            continue
        if not joint.movable and joint.kind != "fixed":
            raise DescriptionError(
                f"joint '{joint.name}': type '{joint.kind}' is not simulated; revolute, continuous, "
                "prismatic and fixed are, and ball where it closes a loop"
            )
        tree[joint.parent].append(joint.name)
        tree[joint.child].append(joint.name)
        one += other
        parts |= dict.fromkeys(other, one)
    roots, reached = [], set[str]()
    for root in [*(name for name in tree if name not in first), *tree]:
        if root in reached:
            continue
        roots.append(root)
        todo = [root]
        for link in todo:
            reached.add(link)
            for name in tree[link]:
                if joints[name].child == link and joints[name].parent not in reached:
                    joints[name] = _reversed(joints[name])
                if joints[name].child not in reached:
                    todo.append(joints[name].child)  # the list grows while it is walked
    return roots


def _reversed(joint: Joint) -> Joint:
    anchor = joint.pose.compose(joint.anchor) if joint.movable else Pose()
    return replace(
        joint, parent=joint.child, child=joint.parent, pose=joint.pose.inverse(), anchor=anchor,
        axis=scale(joint.axis, -1.0),
    )  # fmt: skip


def _close(links: dict[str, Link], joints: dict[str, Joint], joint: Joint, warnings: list[str]) -> None:
    """Hangs a helper link from a joint in place of its child, which something else carries."""
    if joint.parent == joint.child:
        raise DescriptionError(f"joint '{joint.name}' joins link '{joint.child}' to itself")
    closing = {"fixed": "", BALL: BALL}.get(joint.kind, "weld" if joint.movable else None)
    if closing is None:
        warnings.append(f"joint '{joint.name}': type '{joint.kind}' is left out of its loop")
        del joints[joint.name]
        return
    name = f"{joint.child}::{joint.name}"
    links[name] = Link(name, part_of=joint.child, closing=closing)
    joints[joint.name] = replace(joint, child=name, kind=joint.kind if joint.movable else "fixed")


def in_loops(model: ModelDescription) -> set[str]:
    """Returns the joints of all loops, and of rings of fixed joints."""
    joints: set[str] = set()
    for link in model.links.values():
        ways = ({joint.name for joint in model.carriers(end)} for end in (link.owner, link.name))
        joints |= set.symmetric_difference(*ways)
    return joints


def closed(model: ModelDescription, states: States, goals: Mapping[str, float]) -> States | None:
    """Returns states of the movable joints with closed loops, near `states`; None if none is found.

    Joints with goals [rad, m] go there in steps, with all loops closed, so that none changes to another
    branch, and keep their velocities.
    """
    joints = model.movable_joints
    places = {joint.name: place for place, joint in enumerate(joints)}
    loose = in_loops(model) - set(goals) - set(model.mimics)
    free = [name for name in places if name in loose]
    follow = np.zeros((len(joints), len(free)))  # motion of all joints for that of the free ones
    follow[[places[name] for name in free], range(len(free))] = 1.0
    for name, mimic in model.mimics.items():
        follow[places[name]] = mimic.multiplier * follow[places[mimic.driver]]
    at = {name: position for name, (position, _) in states.items()}
    ways = {name: goal - at[name] for name, goal in goals.items()}
    steps = min(MOST_STEPS, math.ceil(max(map(abs, ways.values()), default=0.0) / LONGEST)) or 1
    if np.abs(_open(model, at | dict(goals))[0]).max() < CLOSE:
        steps = 1  # in between all joints needn't fit
    for step in range(1, steps + 1):
        at |= {name: goals[name] - way * (1.0 - step / steps) for name, way in ways.items()}
        for name, mimic in model.mimics.items():
            wanted = mimic.multiplier * at[mimic.driver] + mimic.offset
            at[name] = model.joints[name].clamped(wanted)
        for _ in range(ITERATIONS):
            gap, matrix = _open(model, at)
            if np.abs(gap).max() < CLOSE:
                break
            change = np.linalg.lstsq(matrix @ follow, gap, rcond=1e-9)[0]
            change *= min(1.0, LONGEST / max(np.abs(change).max(initial=0.0), 1e-300))
            for joint, row in zip(joints, follow, strict=True):
                if row.any():
                    at[joint.name] = joint.clamped(at[joint.name] + float(row @ change))
        else:
            return None
    speeds = np.array([states[name][1] for name in places])
    speeds -= follow @ np.linalg.lstsq(matrix @ follow, matrix @ speeds, rcond=1e-9)[0]
    return {name: (at[name], float(speeds[place])) for name, place in places.items()}


def _open(model: ModelDescription, at: Mapping[str, float]) -> tuple[np.ndarray, np.ndarray]:
    """Returns how far loops are open [m, rad], and what joints change of it, negative (n, joints)."""
    joints, poses = model.movable_joints, link_poses(model, Pose(), at)
    pins = {joint.child: joint.anchor for joint in model.joints.values()}
    gaps, rows = [], []
    for helper in model.loops:
        ends = helper.name, helper.part_of
        own, whole = (poses[link].compose(pins[helper.name]) for link in ends)
        size = 3 if helper.closing == BALL else 6
        gaps.append((subtract(own.position, whole.position) + rotation(whole, own))[:size])
        point = np.array(whole.position)
        ways = [np.vstack(jacobian(model, joints, 0, poses, link, point)) for link in ends]
        rows.append((ways[1] - ways[0])[:size])
    return np.concatenate(gaps), np.vstack(rows)
