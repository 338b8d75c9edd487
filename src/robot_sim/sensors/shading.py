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
    met = np.flatnonzero(hits.targets != NONE)
    normals = np.zeros((len(directions), 3))
    for target in np.unique(hits.targets[met]):
        rays = met[hits.targets[met] == target]
        points = origin + hits.distances[rays, None] * directions[rays]
        normals[rays] = scene.normals(target, points, hits.triangles[rays])
        seen[rays] = _own_colours(scene, target, hits.triangles[rays], hits.weights[rays])
    # Meshes' triangles may face either way: light falls on the side that is seen.
    away = np.einsum("ij,ij->i", normals, directions) > 0.0
    normals[away] *= -1.0
    seen[met] *= _light(scene.state.beams, normals[met])
    return seen


def _light(beams: Iterable[Beam], normals: np.ndarray) -> np.ndarray:
    """Returns the light (k, 3) on surfaces with these normals."""
    found = np.full_like(normals, AMBIENT)
    for direction, strength in beams:
        facing = np.maximum(normals @ -direction / (np.linalg.norm(direction) or 1.0), 0.0)
        found += DIFFUSE * facing[:, None] * strength
    return found


def _own_colours(
    scene: RayCaster, target: int, triangles: np.ndarray, weights: np.ndarray
) -> np.ndarray:
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
