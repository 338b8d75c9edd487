"""Flat shading of ray hits by the world's directional lights, with the textures of meshes."""

from collections.abc import Iterable

import numpy as np

from robot_sim.physics.description import Light
from robot_sim.physics.pose import rotate
from robot_sim.pictures.visuals import GREY
from robot_sim.sensors.rays import NONE, Hits, RayScene

BACKGROUND = 178.0  # of each channel, as Gazebo's
GROUND = (0.8, 0.8, 0.8, 1.0)  # of a plane without a colour
AMBIENT, DIFFUSE = 0.4, 0.6  # the latter of a light as bright as Gazebo's sun
BRIGHT = 0.8
SUN = Light("sun", (BRIGHT, BRIGHT, BRIGHT, 1.0), direction=(-0.5, 0.1, -0.9), kind="directional")


def colours(scene: RayScene, hits: Hits, origin: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Returns the colours (n, 3), 0 to 255, of what rays from `origin` in `directions` (n, 3) have met."""
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
    seen[met] *= _light(scene.world.lights.values(), normals[met])
    return seen


def _light(lights: Iterable[Light], normals: np.ndarray) -> np.ndarray:
    """Returns the light (k, 3) on surfaces with these normals; without any directional light the sun's."""
    found = np.full_like(normals, AMBIENT)
    for light in [each for each in lights if each.kind == "directional"] or [SUN]:
        direction = np.array(rotate(light.pose.orientation, light.direction))
        facing = np.maximum(normals @ -direction / (np.linalg.norm(direction) or 1.0), 0.0)
        found += DIFFUSE * facing[:, None] * (np.array(light.diffuse[:3]) / BRIGHT)
    return found


def _own_colours(
    scene: RayScene, target: int, triangles: np.ndarray, weights: np.ndarray
) -> np.ndarray:
    """Returns the unlit colours (k, 3) of points of a target."""
    shape, piece = scene.targets[target].shape, scene.targets[target].piece
    rgba = piece.rgba if piece else shape.rgba or (GROUND if shape.kind == "plane" else GREY)
    tint = 255.0 * np.array(rgba[:3])
    if piece is None or piece.texture is None or piece.uvs is None:
        return np.broadcast_to(tint, (len(triangles), 3))
    corners = piece.uvs.reshape(-1, 3, 2)[triangles]
    shares = np.column_stack([1.0 - weights.sum(axis=1), weights])
    places = np.einsum("kc,kcj->kj", shares, corners) % 1.0
    height, width = piece.texture.shape[:2]
    columns = np.minimum((places[:, 0] * width).astype(int), width - 1)
    rows = np.minimum(((1.0 - places[:, 1]) * height).astype(int), height - 1)
    return np.asarray(piece.texture[rows, columns] / 255.0 * tint)
