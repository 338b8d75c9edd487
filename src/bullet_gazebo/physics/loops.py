"""Closed loops of joints: a spanning tree with welds for the engines, and positions that close the loops.

What fixed joints join is one body: they are in the tree first, with either end as the parent. A joint that
closes a loop carries a helper link of its own, which the engines weld to the joint's child and give a share
of the child's inertia. So it is a joint like any other, with a position, stops, damping and motors.
"""

from collections.abc import Callable, Collection, Mapping
from dataclasses import replace

import numpy as np

from bullet_gazebo.physics.description import DescriptionError, Joint, Link, ModelDescription
from bullet_gazebo.physics.dynamics import jacobian, link_poses
from bullet_gazebo.physics.lumping import check_links
from bullet_gazebo.physics.pose import Pose, rotation, scale, subtract

ITERATIONS = 50
CLOSE = 1e-9  # [m, rad]
LONGEST = 0.2  # [rad, m] of a joint in one iteration: a linearised rotation is valid no further

States = dict[str, tuple[float, float]]
"""Position [rad, m] and velocity [rad/s, m/s] by joint."""


def span(links: dict[str, Link], joints: dict[str, Joint]) -> list[str]:
    """Makes trees of links and joints, in place; returns their roots.

    A root is the first link that no joint carries. Of the joints to a link the first one is in the tree.
    """
    check_links(links, joints)
    first: dict[str, str] = {}
    for joint in joints.values():
        first.setdefault(joint.child, joint.name)
    parts = {name: [name] for name in links}  # the links that are joined to each one
    tree: dict[str, list[str]] = {name: [] for name in links}
    for joint in sorted(
        joints.values(), key=lambda each: (each.kind != "fixed", first[each.child] != each.name)
    ):
        one, other = parts[joint.parent], parts[joint.child]
        if one is other:
            _close(links, joints, joint)
            continue
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
        joint,
        parent=joint.child,
        child=joint.parent,
        pose=joint.pose.inverse(),
        anchor=anchor,
        axis=scale(joint.axis, -1.0),
    )


def _close(links: dict[str, Link], joints: dict[str, Joint], joint: Joint) -> None:
    """Hangs a helper link from a joint in place of its child, which something else carries."""
    if joint.parent == joint.child:
        raise DescriptionError(f"joint '{joint.name}' joins link '{joint.child}' to itself")
    name = f"{joint.child}::{joint.name}"
    links[name] = Link(name, part_of=joint.child, welded=joint.movable)
    joints[joint.name] = replace(joint, child=name)


def in_loops(model: ModelDescription) -> set[str]:
    """Returns the joints of all loops, and of rings of fixed joints."""
    found: set[str] = set()
    for link in model.links.values():
        ways = ({joint.name for joint in model.carriers(end)} for end in (link.owner, link.name))
        found |= set.symmetric_difference(*ways)
    return found


def closed(
    model: ModelDescription,
    states: Mapping[str, tuple[float, float]],
    held: Collection[str],
    clamp: Callable[[str, float], float],
) -> States | None:
    """Returns states of the movable joints with closed loops, near `states`; None if none is found.

    Args:
        model: the model.
        states: position and velocity of each movable joint.
        held: joints that keep theirs.
        clamp: returns the position [rad, m] within a joint's stops.
    """
    joints = model.movable_joints
    places = {joint.name: place for place, joint in enumerate(joints)}
    loose = in_loops(model) - set(held) - set(model.mimics)
    free = [name for name in places if name in loose]
    follow = np.zeros((len(joints), len(free)))  # motion of all joints for that of the free ones
    follow[[places[name] for name in free], range(len(free))] = 1.0
    for name, mimic in model.mimics.items():
        follow[places[name]] = mimic.multiplier * follow[places[mimic.driver]]
    at = {name: position for name, (position, _) in states.items()}
    for _ in range(ITERATIONS):
        poses = link_poses(model, Pose(), at)
        gaps, rows = [], []
        for helper in model.loops:
            own, whole = poses[helper.name], poses[helper.part_of]
            gaps.append(subtract(own.position, whole.position) + rotation(whole, own))
            point = np.array(whole.position)
            ways = [
                np.vstack(jacobian(model, joints, 0, poses, link, point))
                for link in (helper.part_of, helper.name)
            ]
            rows.append(ways[0] - ways[1])
        gap, matrix = np.concatenate(gaps), np.vstack(rows)
        if np.abs(gap).max() < CLOSE:
            speeds = np.array([states[name][1] for name in places])
            speeds -= follow @ np.linalg.lstsq(matrix @ follow, matrix @ speeds, rcond=1e-9)[0]
            return {name: (at[name], float(speeds[place])) for name, place in places.items()}
        step = np.linalg.lstsq(matrix @ follow, gap, rcond=1e-9)[0]
        moves = follow @ step * min(1.0, LONGEST / max(np.abs(step).max(initial=0.0), 1e-300))
        for name, place in places.items():
            if moves[place]:
                at[name] = clamp(name, at[name] + float(moves[place]))
    return None
