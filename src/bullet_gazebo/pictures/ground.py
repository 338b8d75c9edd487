"""What is behind everything: a sky, and a ground of tiles that fade away towards the horizon."""

import math
from typing import NamedTuple

import numpy as np

from bullet_gazebo.pictures.camera import Camera

SKY = (238, 242, 247)
TILES = ((222, 225, 230), (203, 207, 213))
TILES_IN_SIGHT = 8.0  # within the camera's distance
FADING = 3.0  # of the camera's distance, until a third of the colours is left


class Background(NamedTuple):
    """Colours (h, w, 3) of uint8, and how far away the ground is in OpenGL's measure, row by row (h, 1): 1 is
    none."""

    colours: np.ndarray
    depth: np.ndarray


def background(camera: Camera, width: int, height: int) -> Background:
    """What the camera would see of an empty world, whose ground is at z = 0."""
    across = (np.arange(width) + 0.5 - width / 2.0) * (2.0 * camera.slope / height)
    down = (np.arange(height)[:, np.newaxis] + 0.5 - height / 2.0) * (2.0 * camera.slope / height)
    right, up, forward = camera.axes
    eye = camera.eye
    falling = forward[2] - down * up[2]  # the same all along a row: the camera stands upright
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = np.where(falling * eye[2] < 0.0, -eye[2] / falling, np.inf)
    seen = reach < camera.far
    reach = np.where(seen, reach, camera.far)
    size = _tile(camera.distance)
    odd = np.zeros((height, width), bool)
    for axis in (0, 1):
        start = eye[axis] + reach * (forward[axis] - down * up[axis])
        places = (start / size) + (reach * right[axis] / size) * across
        odd ^= (np.floor(places).astype(np.int32) & 1).astype(bool)
    strength = np.where(seen, np.exp(-reach / (FADING * camera.distance)), 0.0)
    even_rows, odd_rows = (
        np.rint(np.array(SKY) + strength * (np.array(tile) - np.array(SKY))).astype(np.uint8)
        for tile in TILES
    )
    colours = np.where(odd[..., np.newaxis], odd_rows[:, np.newaxis], even_rows[:, np.newaxis])
    return Background(colours, np.where(seen, _depth(reach, camera), 1.0).astype(np.float32))


def _tile(distance: float) -> float:
    """A side of 1, 2 or 5 times a power of ten [m]."""
    wanted = distance / TILES_IN_SIGHT
    power = 10.0 ** math.floor(math.log10(wanted))
    return power * next(step for step in (5.0, 2.0, 1.0) if step * power <= wanted)


def _depth(reach: np.ndarray, camera: Camera) -> np.ndarray:
    near, far = camera.near, camera.far
    return far * (reach - near) / (np.maximum(reach, near) * (far - near))
