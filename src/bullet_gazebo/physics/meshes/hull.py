"""The points that a convex body is made of, as few as an engine can compute with in time."""

import numpy as np

MOST_POINTS = 4096  # of a hull; PyBullet walks through all of them at each contact, in each step


def hull_points(points: np.ndarray) -> np.ndarray:
    """Returns points (k, 3) with the same convex hull as `points` (n, 3), in their order.

    Up to `MOST_POINTS` are returned as they are. A hull that has more corners is cut down to those that lie
    farthest out in as many directions: of a ball that takes 0.1 % of the radius.
    """
    points = _different(points)
    if len(points) <= MOST_POINTS:
        return points
    from scipy.spatial import ConvexHull, QhullError

    try:
        corners = points[np.sort(ConvexHull(points).vertices)]
    except QhullError:  # all of them lie in a plane, or on a line
        corners = points
    return corners if len(corners) <= MOST_POINTS else _outermost(corners)


def _different(points: np.ndarray) -> np.ndarray:
    """Each point once. np.unique does it too, and holds all other threads for as long as it sorts rows."""
    order = np.lexsort(points.T)
    new = np.append(True, (np.diff(points[order], axis=0) != 0.0).any(axis=1))
    return points[np.sort(order[new])]


def _outermost(points: np.ndarray) -> np.ndarray:
    """The farthest points in `MOST_POINTS` directions that a spiral spreads evenly over the sphere."""
    turn = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(MOST_POINTS)
    height = 1.0 - (2.0 * np.arange(MOST_POINTS) + 1.0) / MOST_POINTS
    ring = np.sqrt(1.0 - height**2)
    directions = np.stack([ring * np.cos(turn), ring * np.sin(turn), height], axis=1)
    centred = points - points.mean(axis=0)
    spread = np.abs(centred).max(axis=0)
    centred = (
        centred / np.where(spread > 0.0, spread, 1.0)
    ).T  # a flat body has as fine an outline
    some = np.split(directions, MOST_POINTS // 32)  # at a time: memory
    farthest = [(each @ centred).argmax(axis=1) for each in some]
    return points[np.unique(np.concatenate(farthest))]
