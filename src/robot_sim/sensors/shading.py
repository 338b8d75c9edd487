"""Flat shading of ray hits by the world's directional lights, with the textures of meshes."""

from collections.abc import Iterable

import numpy as np

from robot_sim.sensors.rays import Hits, RayCaster, picked
from robot_sim.sensors.scene import Beam

BACKGROUND = 178  # of each channel, as Gazebo's
AMBIENT, DIFFUSE = 0.4, 0.6  # the latter of a light as bright as Gazebo's sun


def colours(scene: RayCaster, hits: Hits, origin: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Returns the colours (n, 3) of uint8 of what rays from `origin` in `directions` (n, 3) have met."""
    assert scene.state is not None  # it has been cast
    # A plane looks alike everywhere: one of its rays is enough.
    flat = [np.flatnonzero(hits.targets == plane) for plane in scene.planes]
    rays = np.concatenate([*(each[:1] for each in flat), np.flatnonzero(scene.are_solid[hits.targets])])
    targets, triangles, ways = hits.targets[rays], hits.triangles[rays], picked(directions, rays)
    normals = scene.normals(targets, origin + hits.distances[rays, None] * ways, triangles)
    # Meshes' triangles may face either way: light falls on the side that is seen.
    normals *= np.where(np.einsum("ij,ij->i", normals, ways) > 0.0, -1.0, 1.0)[:, None]
    own = _own_colours(scene, targets, triangles, hits.weights[rays])
    seen = np.full((len(directions), 3), BACKGROUND, np.uint8)
    seen[rays] = np.rint(np.clip(own * _light(scene.state.beams, normals), 0.0, 255.0))
    for each in flat:
        seen[each] = seen[each[:1]]
    return seen


def _light(beams: Iterable[Beam], normals: np.ndarray) -> np.ndarray:
    """Returns the light (k, 3) on surfaces with these normals."""
    found = np.full_like(normals, AMBIENT)
    for direction, strength in beams:
        facing = np.maximum(normals @ -direction / (np.linalg.norm(direction) or 1.0), 0.0)
        found += np.multiply.outer(strength, DIFFUSE * facing).T
    return found


def _own_colours(
    scene: RayCaster, targets: np.ndarray, triangles: np.ndarray, weights: np.ndarray
) -> np.ndarray:
    """Returns the unlit colours (k, 3) of points of targets (k,)."""
    found = picked(scene.tints, targets)
    for target, some in scene.mesh_points(targets):
        piece = scene.targets[target].piece
        if piece is None or piece.texture is None or piece.uvs is None:
            continue
        corners = piece.uvs.reshape(-1, 3, 2)[triangles[some]]
        shares = np.column_stack([1.0 - weights[some].sum(axis=1), weights[some]])
        places = np.einsum("kc,kcj->kj", shares, corners) % 1.0
        height, width = piece.texture.shape[:2]
        columns = np.minimum((places[:, 0] * width).astype(int), width - 1)
        rows = np.minimum(((1.0 - places[:, 1]) * height).astype(int), height - 1)
        found[some] *= piece.texture[rows, columns] / 255.0
    return found
