"""Convex hulls with as few points as an engine can handle in time, and concave meshes in convex pieces."""

import numpy as np

MOST_POINTS = 4096  # of a hull; PyBullet walks through all of them at each contact, in each step
PIECE = 50_000  # points that are processed together, to bound memory
LEFT = 0.9  # of the points; if more are left, another pass is of no use
# Points and directions of one product: NumPy splits larger ones among threads, which wait for each other on
# a busy machine.
BLOCK = 256

MOST_PIECES = 16  # of a mesh
PIECE_CORNERS = 64
VOXELS = 100_000  # seconds of computing; V-HACD's 400,000 take three times as long
CONVEX = 0.95  # of the hull's volume: a mesh that fills it is convex enough
FLAT = 1e-6  # thickness by length


def hull_points(points: np.ndarray) -> np.ndarray:
    """Returns points (k, 3) with the same convex hull as `points` (n, 3), in their order.

    Up to `MOST_POINTS` are returned as they are. A hull that has more corners is cut down to those that lie
    farthest out in as many directions: of a ball that takes 0.1 % of the radius.
    """
    points = _different(points)
    while len(points) > MOST_POINTS:
        pieces = np.array_split(points, len(points) // PIECE + 1)
        corners = np.concatenate([_corners(piece) for piece in pieces])
        if len(corners) > LEFT * len(points):
            return _outermost(corners) if len(corners) > MOST_POINTS else corners
        points = corners
    return points


def convex_pieces(vertices: np.ndarray, faces: np.ndarray) -> list[np.ndarray]:
    """Returns the corners (k, 3) of convex bodies that fill a mesh; none if it is convex enough itself."""
    import trimesh
    from manifold3d import Manifold
    from vhacdx import compute_vhacd

    mesh = trimesh.Trimesh(vertices, faces)  # joins corners
    if mesh.is_watertight:
        hull = Manifold.hull_points(mesh.vertices)
        if abs(mesh.volume) > CONVEX * hull.volume():
            return []
    counted = np.insert(mesh.faces, 0, 3, axis=1)  # corners of each face, as VTK has it
    pieces = compute_vhacd(
        mesh.vertices, counted.ravel().astype(np.uint32), maxConvexHulls=MOST_PIECES,
        maxNumVerticesPerCH=PIECE_CORNERS, resolution=VOXELS, asyncACD=False,
    )  # fmt: skip
    return [corners for corners, _ in pieces if is_solid(corners)]


def is_solid(points: np.ndarray) -> bool:
    """Returns whether the points (n, 3) don't all lie in a plane."""
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return len(spread) == 3 and bool(spread[2] > FLAT * spread[0])


def _different(points: np.ndarray) -> np.ndarray:
    """Returns each point once. np.unique would block all other threads while it sorts rows."""
    order = np.lexsort(points.T)
    new = np.append(True, (np.diff(points[order], axis=0) != 0.0).any(axis=1))
    return points[np.sort(order[new])]


def _corners(points: np.ndarray) -> np.ndarray:
    """Returns the corners of the convex hull; all points, if they are flat."""
    from manifold3d import Manifold

    scaled = _scaled(points)
    hull = Manifold.hull_points(scaled)
    if hull.volume() == 0.0:
        return points
    # It has copies of them: each is found right behind the point.
    both = np.concatenate([scaled, hull.to_mesh64().vert_properties])
    order = np.lexsort(both.T)
    is_copy = (np.diff(both[order], axis=0) == 0.0).all(axis=1)
    return points[np.sort(order[:-1][is_copy])]


def _outermost(points: np.ndarray) -> np.ndarray:
    """Returns the farthest points in `MOST_POINTS` directions, spread evenly over the sphere by a spiral."""
    turn = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(MOST_POINTS)
    height = 1.0 - (2.0 * np.arange(MOST_POINTS) + 1.0) / MOST_POINTS
    ring = np.sqrt(1.0 - height**2)
    directions = np.stack([ring * np.cos(turn), ring * np.sin(turn), height], axis=1)
    scaled = _scaled(points).T
    best, farthest = np.full(MOST_POINTS, -np.inf), np.zeros(MOST_POINTS, int)
    for start in range(0, len(points), BLOCK):
        piece = np.ascontiguousarray(scaled[:, start : start + BLOCK])
        for some in np.array_split(np.arange(MOST_POINTS), MOST_POINTS // BLOCK):
            reach = directions[some] @ piece
            index = reach.argmax(axis=1)
            value = reach[np.arange(len(some)), index]
            better = value > best[some]
            best[some[better]], farthest[some[better]] = value[better], start + index[better]
    return points[np.unique(farthest)]


def _scaled(points: np.ndarray) -> np.ndarray:
    """Returns the points about their mean, within 1 along each axis: so hulls are as fine of what is flat or
    far from the origin. Their corners are the same.
    """
    centred = points - points.mean(axis=0)
    spread = np.abs(centred).max(axis=0)
    return centred / np.where(spread > 0.0, spread, 1.0)
