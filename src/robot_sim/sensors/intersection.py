"""Exact ray intersections with boxes, balls and cylinders, for many pairs at once.

Shapes are centred in their own frames, and rays are given there: origins (k, 3) [m] and directions (k, 3) of
length 1. A ray that starts inside a shape meets it where it leaves. A ray that misses has distance inf.
"""

import math
from collections.abc import Callable

import numpy as np

Numbers = np.ndarray
Distances = Callable[[Numbers, Numbers, Numbers], Numbers]


def box_distances(origins: Numbers, directions: Numbers, sizes: Numbers) -> Numbers:
    """Returns distances (k,) to boxes with edges `sizes` (k, 3), by the slab method."""
    with np.errstate(divide="ignore", invalid="ignore"):
        low = (-0.5 * sizes - origins) / directions
        high = (0.5 * sizes - origins) / directions
    # A ray within the plane of a face gives 0 / 0, which neither limits nor excludes it.
    enter = np.fmin(low, high).max(axis=1, initial=-np.inf, where=~np.isnan(low))
    leave = np.fmax(low, high).min(axis=1, initial=np.inf, where=~np.isnan(high))
    return _first(enter, leave, enter <= leave)


def ball_distances(origins: Numbers, directions: Numbers, sizes: Numbers) -> Numbers:
    """Returns distances (k,) to balls of radius `sizes[:, 0]`."""
    middle = -np.einsum("ij,ij->i", origins, directions)
    nearest = origins + middle[:, None] * directions
    # From the point nearest to the centre: the usual b² - c loses the digits of a ball far away.
    room = sizes[:, 0] ** 2 - np.einsum("ij,ij->i", nearest, nearest)
    half = np.sqrt(np.maximum(room, 0.0))
    return _first(middle - half, middle + half, room >= 0.0)


def cylinder_distances(origins: Numbers, directions: Numbers, sizes: Numbers) -> Numbers:
    """Returns distances (k,) to cylinders along z with radius `sizes[:, 0]` and length `sizes[:, 1]`."""
    across = np.einsum("ij,ij->i", directions[:, :2], directions[:, :2])
    along = directions[:, 2]
    with np.errstate(divide="ignore", invalid="ignore"):
        middle = -np.einsum("ij,ij->i", origins[:, :2], directions[:, :2]) / across
        nearest = origins[:, :2] + middle[:, None] * directions[:, :2]
        room = sizes[:, 0] ** 2 - np.einsum("ij,ij->i", nearest, nearest)
        half = np.sqrt(np.maximum(room, 0.0) / across)
        low = (-0.5 * sizes[:, 1] - origins[:, 2]) / along
        high = (0.5 * sizes[:, 1] - origins[:, 2]) / along
    enter, leave, meets = middle - half, middle + half, room >= 0.0
    parallel = across == 0.0
    if parallel.any():
        inside = np.einsum("ij,ij->i", origins[:, :2], origins[:, :2]) <= sizes[:, 0] ** 2
        enter = np.where(parallel, -np.inf, enter)
        leave = np.where(parallel, np.inf, leave)
        meets = np.where(parallel, inside, meets)
    level = along == 0.0
    enter = np.maximum(enter, np.where(level, -np.inf, np.fmin(low, high)))
    leave = np.minimum(leave, np.where(level, np.inf, np.fmax(low, high)))
    meets &= ~level | (np.abs(origins[:, 2]) <= 0.5 * sizes[:, 1])
    return _first(enter, leave, meets & (enter <= leave))


def _first(enter: Numbers, leave: Numbers, meets: Numbers) -> Numbers:
    """Returns where a ray enters, or leaves if it starts inside; inf if it misses or looks away."""
    distances = np.where(enter >= 0.0, enter, leave)
    return np.where(meets & (leave >= 0.0), distances, np.inf)


def box_normals(points: Numbers, sizes: Numbers) -> Numbers:
    """Returns the outward normals (k, 3) at points of the surfaces of boxes with edges `sizes` (k, 3)."""
    shares = points / (0.5 * sizes)
    axes = np.abs(shares).argmax(axis=1)
    rows = np.arange(len(points))
    normals = np.zeros_like(points)
    normals[rows, axes] = np.sign(shares[rows, axes])
    return normals


def ball_normals(points: Numbers, sizes: Numbers) -> Numbers:
    """Returns the outward normals (k, 3) of balls of radius `sizes[:, 0]`."""
    return np.asarray(points / sizes[:, :1])


def cylinder_normals(points: Numbers, sizes: Numbers) -> Numbers:
    """Returns the outward normals (k, 3) of cylinders of radius `sizes[:, 0]` and length `sizes[:, 1]`."""
    height = points[:, 2] / (0.5 * sizes[:, 1])
    on_side = np.hypot(points[:, 0], points[:, 1]) / sizes[:, 0] >= np.abs(height)
    side = np.column_stack([points[:, :2] / sizes[:, :1], np.zeros(len(points))])
    end = np.column_stack([np.zeros((len(points), 2)), np.sign(height)])
    return np.where(on_side[:, None], side, end)


def plane_normals(points: Numbers, sizes: Numbers) -> Numbers:
    """Returns the normals (k, 3) of a plane through its x and y axes."""
    return np.broadcast_to((0.0, 0.0, 1.0), points.shape)


def reach(kind: str, size: tuple[float, ...]) -> float:
    """Returns how far from its middle a box, ball or cylinder reaches [m]."""
    if kind == "box":
        return math.hypot(*size) / 2.0
    return size[0] if kind == "sphere" else math.hypot(size[0], size[1] / 2.0)


DISTANCES: dict[str, Distances] = {
    "box": box_distances,
    "sphere": ball_distances,
    "cylinder": cylinder_distances,
}
NORMALS: dict[str, Callable[[Numbers, Numbers], Numbers]] = {
    "box": box_normals,
    "sphere": ball_normals,
    "cylinder": cylinder_normals,
    "plane": plane_normals,
}
