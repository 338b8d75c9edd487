"""Distances between angles (docs/contract/ros_control.md 3.2)."""

import math

TURN = 2.0 * math.pi


def normalized(angle: float) -> float:
    """Returns `angle` [rad] in (-pi, pi]."""
    if -math.pi < angle <= math.pi:  # nearly always true, and several times cheaper than fmod
        return angle
    angle = math.fmod(angle + math.pi, TURN)
    return angle + math.pi if angle <= 0.0 else angle - math.pi


def shortest_distance(start: float, end: float) -> float:
    """Returns the shortest turn [rad] from `start` to `end`; exactly half a turn is positive."""
    return normalized(end - start)


def shortest_distance_within(start: float, end: float, lower: float, upper: float) -> float:
    """Returns the shortest turn from `start` to `end` that stops inside [lower, upper].

    If neither way round does, the shorter one is returned, as upstream does when the joint has left
    its limits.
    """
    short = shortest_distance(start, end)
    for turn in (short, short - math.copysign(TURN, short)):
        if lower - 1e-9 <= start + turn <= upper + 1e-9:
            return turn
    return short
