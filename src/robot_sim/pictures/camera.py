"""The camera of a picture, and its background: a sky, and tiles that fade towards the horizon."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from robot_sim.physics.pose import Vector

NEAR, FAR = 0.02, 100.0  # clipping planes, as multiples of the camera's distance
MARGIN = 1.1  # factor on the width and height that an overview must show
THIRD = 2.8  # the same, for a robot that fills a third of the picture
ASPECT = 4.0 / 3.0  # of what a browser's window shows beside the panel
RANGES = {  # of each number of a field that a user names
    "target": (-1e6, 1e6), "distance": (1e-3, 1e6), "yaw": (-360.0, 360.0), "pitch": (-90.0, 90.0),
    "view": (1.0, 170.0), "follows": (0, 1),
}  # fmt: skip
SKY = (228, 235, 243)  # neither white, grey nor black, so that robots stand out
TILES = ((134, 153, 174), (117, 137, 159))
TILES_IN_SIGHT = 8.0  # within the camera's distance
FADING = 3.0  # of the camera's distance, until a third of the colour is left


@dataclass(frozen=True)
class Camera:
    """A camera that looks at a point; z is up.

    Args:
        target: The point [m].
        distance: From the camera to the target [m].
        yaw: [degrees]; at 0 it looks along +y, with x to the right, at 90 along -x.
        pitch: [degrees]; negative looks down.
        view: Vertical field of view [degrees].
        follows: Whether it follows a robot that drives, in an environment's pictures.
    """

    target: Vector = (0.0, 0.0, 0.0)
    distance: float = 2.0
    yaw: float = 20.0
    pitch: float = -15.0
    view: float = 40.0
    follows: bool = True

    def at(self, target: Vector) -> "Camera":
        """Returns a copy that looks at another point [m]."""
        return replace(self, target=target)

    def changed(self, fields: Mapping[str, Any]) -> "Camera":
        """Returns a copy with other values of some fields.

        Raises ValueError for an unknown field, or a value that it can't have.
        """
        for name, value in fields.items():
            if name not in RANGES:
                raise ValueError(f"a camera has no {name!r}; it has {', '.join(RANGES)}")
            (low, high), like, found = RANGES[name], getattr(self, name), np.array(value)
            fits = found.shape == np.shape(like) and found.dtype.kind in "bif"
            fits = fits and (isinstance(value, bool) or not isinstance(like, bool))
            if not fits or (np.clip(found, low, high) != found).any():
                raise ValueError(f"a camera's {name} is like {like}, in [{low:g}, {high:g}]: {value!r}")
        given: Any = {name: tuple(v) if name == "target" else v for name, v in fields.items()}
        return replace(self, **given)

    @property
    def axes(self) -> np.ndarray:
        """Right, up and forward in the world: rows of (3, 3)."""
        yaw, pitch = math.radians(self.yaw), math.radians(self.pitch)
        right = (math.cos(yaw), math.sin(yaw), 0.0)
        level = (-math.sin(yaw), math.cos(yaw))
        forward = (level[0] * math.cos(pitch), level[1] * math.cos(pitch), math.sin(pitch))
        return np.array([right, np.cross(right, forward), forward])

    @property
    def eye(self) -> np.ndarray:
        """Its position [m]."""
        return np.array(self.target) - self.distance * self.axes[2]

    @property
    def near(self) -> float:
        """The distance of the near clipping plane [m]."""
        return NEAR * self.distance

    @property
    def far(self) -> float:
        """The distance of the far clipping plane [m]."""
        return FAR * self.distance

    @property
    def slope(self) -> float:
        """Half the height of its view at a distance of 1."""
        return math.tan(math.radians(self.view) / 2.0)


CameraLike = Camera | Mapping[str, Any] | None
"""A camera, some fields that differ from those of the one that is used by default, or that one."""


def overview(
    points: np.ndarray, aspect: float, looking: Camera | None = None, margin: float = MARGIN
) -> Camera:
    """Returns a camera that sees all of `points` [m] (n, 3), in the direction of `looking`."""
    looking = looking or Camera()
    if not len(points):
        return looking
    low, high = points.min(axis=0), points.max(axis=0)
    x, y, z = ((low + high) / 2.0).tolist()
    right, up, forward = looking.axes
    seen = points - (x, y, z)
    # How far away the camera has to be to see each point.
    sideways, upright = abs(seen @ right) / aspect, abs(seen @ up)
    needed = np.maximum(sideways, upright) * margin / looking.slope - seen @ forward
    return replace(looking, target=(x, y, z), distance=max(float(needed.max()), 1e-3))


class Background(NamedTuple):
    """Colours (h, w, 3) of uint8, and the ground's OpenGL depth by row (h, 1), 1 where there is none."""

    colours: np.ndarray
    depth: np.ndarray


def background(camera: Camera, width: int, height: int) -> Background:
    """Draws the empty world that the camera sees, with its ground at z = 0."""
    across = (np.arange(width) + 0.5 - width / 2.0) * (2.0 * camera.slope / height)
    down = (np.arange(height)[:, np.newaxis] + 0.5 - height / 2.0) * (2.0 * camera.slope / height)
    right, up, forward = camera.axes
    eye = camera.eye
    falling = forward[2] - down * up[2]  # the same along a row: the camera is upright
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
    near, far = camera.near, camera.far
    depth = far * (reach - near) / (np.maximum(reach, near) * (far - near))
    return Background(colours, np.where(seen, depth, 1.0).astype(np.float32))


def _tile(distance: float) -> float:
    """Returns the side of a tile [m]: 1, 2 or 5 times a power of ten."""
    wanted = distance / TILES_IN_SIGHT
    power = 10.0 ** math.floor(math.log10(wanted))
    return power * next(step for step in (5.0, 2.0, 1.0) if step * power <= wanted)
