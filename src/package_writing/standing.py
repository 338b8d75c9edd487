"""Feet, stance and standing height of a legged robot."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from robot_sim.physics.description import Joint, ModelDescription, Shape
from robot_sim.physics.dynamics import link_poses
from robot_sim.physics.pose import Pose, Vector, conjugate, multiply, rotate

DOWN = (0.0, 0.0, -1.0)
# Of the height at which a robot stands: how much higher than its lowest link feet may be.
FOOT = 0.05
TILT = 0.05  # [rad] of the ground, which shows how far a sole extends
FLAT = 0.02  # [m], of a sole that has to be level
STEERED = 3  # joints of a leg that can hold its sole level
NEAR = 1e-6  # [m, rad], of a stance
TURNS = 50  # of the search for a stance
STRIDE = 0.2  # [rad, m], of a joint in a turn
SMALL = 1e-4  # [rad, m], for slopes


def stance(model: ModelDescription) -> dict[str, float]:
    """Returns where joints start that don't start at 0 [rad, m, three decimals].

    A joint whose range excludes 0 starts in its middle. The other joints of legs put the feet as they are
    with all joints at 0, flat soles level, with the centre of mass above their middle.
    """
    starts = {
        each.name: (each.lower + each.upper) / 2.0
        if each.bounded and not each.lower <= 0.0 <= each.upper
        else 0.0
        for each in model.movable_joints
    }
    on = feet(model)
    legs = (each for foot in on for each in model.carriers(foot) if each.movable)
    turned = {each.name: each for each in legs if not starts[each.name]}
    if turned:
        _stand(model, on, turned, starts)
    return {name: round(start, 3) for name, start in starts.items() if round(start, 3)}


def _stand(
    model: ModelDescription, on: Sequence[str], turned: Mapping[str, Joint], starts: dict[str, float]
) -> None:
    """Moves the joints `turned`, as little as it takes and within their stops, so that the feet carry it."""
    zero = link_poses(model, Pose(), {})
    flat: dict[str, Pose] = {}  # the middles of soles to hold level, seen from their feet
    first = np.zeros((len(on), 3))
    for place, foot in enumerate(on):
        middle, size = _sole(model, foot, zero[foot])
        first[place] = middle
        if size > FLAT and sum(each.movable for each in model.carriers(foot)) >= STEERED:
            flat[foot] = zero[foot].inverse().compose(Pose(middle))

    def wrong(at: np.ndarray) -> np.ndarray:
        poses = link_poses(model, Pose(), {**starts, **dict(zip(turned, at.tolist(), strict=True))})
        here = [
            poses[foot].compose(flat[foot]).position if foot in flat else _sole(model, foot, poses[foot])[0]
            for foot in on
        ]
        moved = np.array(here) - first
        moved[:, :2] -= centre_of_mass(model, poses)[:2] - first[:, :2].mean(axis=0)
        moved[:, 2] -= moved[:, 2].mean()
        turns = [multiply(poses[foot].orientation, conjugate(zero[foot].orientation)) for foot in flat]
        return np.concatenate([moved.ravel(), *(2.0 * np.array(each[:3]) for each in turns)])

    low, high = np.array(
        [(each.lower, each.upper) if each.bounded else (-math.inf, math.inf) for each in turned.values()]
    ).T
    at = np.zeros(len(turned))
    for _ in range(TURNS):
        here = wrong(at)
        if np.linalg.norm(here) < NEAR:
            break
        slopes = np.array([(wrong(at + each) - here) / SMALL for each in SMALL * np.eye(len(at))]).T
        free = np.full(len(at), True)
        while True:  # a joint at its stop stays there
            steps = -np.linalg.pinv(slopes[:, free], rcond=0.02) @ here
            wanted = at.copy()
            wanted[free] += np.clip(steps, -STRIDE, STRIDE)
            held = free & ((wanted < low) & (at == low) | (wanted > high) & (at == high))
            if not held.any():
                break
            free &= ~held
        at = np.clip(wanted, low, high)
    starts.update(zip(turned, at.tolist(), strict=True))


def _sole(model: ModelDescription, foot: str, pose: Pose) -> tuple[Vector, float]:
    """Returns the middle of a foot's sole, seen from where `pose` is, and its larger side [m].

    Ground that is tilted about the one or the other edge shows how far it extends.
    """
    height = _reach(model, foot, pose, DOWN)
    middle, size = [], 0.0
    for x, y in ((1.0, 0.0), (0.0, 1.0)):
        ends = []
        for way in (1.0, -1.0):
            tilted = (way * x * math.sin(TILT), way * y * math.sin(TILT), -math.cos(TILT))
            far = _reach(model, foot, pose, tilted) - height * math.cos(TILT)
            ends.append(way * far / math.sin(TILT))
        middle.append(sum(ends) / 2.0)
        size = max(size, ends[0] - ends[1])
    return (middle[0], middle[1], -height), size


def centre_of_mass(model: ModelDescription, poses: Mapping[str, Pose]) -> np.ndarray:
    """Returns the centre of mass (3,) of links at `poses`."""
    bodies = [(model.links[name].inertia, pose) for name, pose in poses.items()]
    pairs = [(each.mass, pose.compose(each.com).position) for each, pose in bodies if each is not None]
    masses, places = zip(*pairs, strict=True)
    return np.average(np.array(places), axis=0, weights=masses)


def standing_height(model: ModelDescription, positions: Mapping[str, float]) -> float | None:
    """Returns the least height with all collisions above the ground [m, three decimals]; None without any."""
    lows = lows_of(model, positions)
    if not lows:
        return None
    return max(0.0, math.ceil(round(-min(lows.values()) * 1000.0, 6)) / 1000.0)  # 0.1 stays 0.1


def feet(model: ModelDescription) -> list[str]:
    """Returns the links on which a robot stands, joints at zero, none of them wheels or its base."""
    lows = {} if model.fixed_base else lows_of(model, {})
    ground = min(lows.values(), default=0.0)
    low = [name for name, height in lows.items() if height <= (1.0 - FOOT) * ground]
    kinds = {joint.kind for name in low for joint in model.carriers(name)}
    if model.root in low or "continuous" in kinds:
        return []
    above = {name: {joint.parent for joint in model.carriers(name)} for name in low}
    return [
        name
        for name in low
        if not any(
            (name in above[other] or other in above[name]) and lows[other] < lows[name] - NEAR
            for other in low
        )
    ]


def gait(model: ModelDescription, feet: Sequence[str]) -> dict[str, float]:
    """Returns when feet are put down, as shares of a period: neighbours of a side, and of both, in turn.

    Two legs step one after the other, four trot, six walk on three.
    """
    poses = link_poses(model, Pose(), {})
    phases = {}
    for side, sign in enumerate((1.0, -1.0)):
        row = [each for each in feet if sign * poses[each].position[1] > 0.0]
        row.sort(key=lambda each: -poses[each].position[0])
        phases.update({each: (place + side) % 2 / 2.0 for place, each in enumerate(row)})
    return phases | {each: 0.0 for each in feet if each not in phases}


def lows_of(model: ModelDescription, positions: Mapping[str, float]) -> dict[str, float]:
    """Returns how low each link with a collision reaches, seen from the model [m]."""
    return {
        name: -_reach(model, name, pose, DOWN)
        for name, pose in link_poses(model, model.root_pose, positions).items()
        if model.links[name].collisions
    }


def _reach(model: ModelDescription, link: str, pose: Pose, way: Vector) -> float:
    """Returns how far a link's collisions reach along a direction of length 1 [m]."""
    return max(reach(each, pose.compose(each.pose), way) for each in model.links[link].collisions)


def reach(shape: Shape, pose: Pose, way: Vector) -> float:
    """Returns how far a shape reaches along a direction of length 1, from the origin of its pose [m]."""
    turned = np.array(rotate(conjugate(pose.orientation), way))  # in the shape's frame
    size = np.array(shape.size)
    if shape.kind == "sphere":
        half = float(size[0])
    elif shape.kind == "cylinder":
        half = float(size[0] * math.hypot(turned[0], turned[1]) + size[1] / 2.0 * abs(turned[2]))
    elif shape.solid is not None:
        half = float(np.max(np.concatenate(shape.solid.hulls) * size @ turned))
    else:
        half = float(np.abs(turned) @ size / 2.0)
    return float(np.dot(pose.position, way)) + half
