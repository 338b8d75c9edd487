"""Flat shading of ray hits by the world's directional lights, with the textures of meshes."""

from collections.abc import Iterable

import numpy as np

from robot_sim.sensors.rays import NONE, Hits, RayCaster
from robot_sim.sensors.scene import Beam

BACKGROUND = 178.0  # of each channel, as Gazebo's
AMBIENT, DIFFUSE = 0.4, 0.6  # the latter of a light as bright as Gazebo's sun


def colours(scene: RayCaster, hits: Hits, origin: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Returns the colours (n, 3), 0 to 255, of what rays from `origin` in `directions` (n, 3) have met."""
    assert scene.state is not None  # it has been cast
    seen = np.full((len(directions), 3), BACKGROUND)
    # Short numbers are sorted by radix; beyond their range a target may come in two groups.
    order = np.argsort(hits.targets.astype(np.int16), kind="stable")
    targets = hits.targets[order]
    for rays in np.split(order, np.flatnonzero(np.diff(targets)) + 1):
        target = int(hits.targets[rays[0]])
        if target == NONE:
            continue
        ways, triangles = directions[rays], hits.triangles[rays]
        points = origin + hits.distances[rays, None] * ways
        normals = scene.normals(target, points, triangles)
        # Meshes' triangles may face either way: light falls on the side that is seen.
        away = np.einsum("ij,ij->i", normals, ways) > 0.0
        normals = np.where(away[:, None], -normals, normals)
        own = _own_colours(scene, target, triangles, hits.weights[rays])
        seen[rays] = own * _light(scene.state.beams, normals)
    return seen


def _light(beams: Iterable[Beam], normals: np.ndarray) -> np.ndarray:
    """Returns the light (k, 3) on surfaces with these normals."""
    found = np.full_like(normals, AMBIENT)
    for direction, strength in beams:
        facing = np.maximum(normals @ -direction / (np.linalg.norm(direction) or 1.0), 0.0)
        found += DIFFUSE * facing[:, None] * strength
    return found


def _own_colours(scene: RayCaster, target: int, triangles: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Returns the unlit colours (k, 3) of points of a target."""
    piece = scene.targets[target].piece
    tint = 255.0 * np.array(scene.targets[target].rgba[:3])
    if piece is None or piece.texture is None or piece.uvs is None:
        return np.broadcast_to(tint, (len(triangles), 3))
    corners = piece.uvs.reshape(-1, 3, 2)[triangles]
    shares = np.column_stack([1.0 - weights.sum(axis=1), weights])
    places = np.einsum("kc,kcj->kj", shares, corners) % 1.0
    height, width = piece.texture.shape[:2]
    columns = np.minimum((places[:, 0] * width).astype(int), width - 1)
    rows = np.minimum(((1.0 - places[:, 1]) * height).astype(int), height - 1)
    return np.asarray(piece.texture[rows, columns] / 255.0 * tint)
