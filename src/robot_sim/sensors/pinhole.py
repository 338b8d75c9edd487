"""Cameras: colours and depths of what lies before a pinhole (docs/contract/sensors.md 4)."""

import math
from typing import NamedTuple
from xml.etree.ElementTree import Element

import numpy as np

from robot_sim.physics.description import DescriptionError
from robot_sim.physics.files.sdf_parts import read_pose, value
from robot_sim.physics.pose import Pose
from robot_sim.sensors.frames import frames
from robot_sim.sensors.noise import Noise, read_noise
from robot_sim.sensors.rays import RayCaster
from robot_sim.sensors.scene import FURTHEST, SceneState
from robot_sim.sensors.shading import colours

MOST_PIXELS = 2_100_000  # full HD
LONGEST_SIDE = 65_500  # of a JPEG
PIECE = 1 << 15  # pixels that are looked at together: what they need fits into caches
NOT_ASKED = np.zeros(0)


class CameraView(NamedTuple):
    """What a camera sees; `NOT_ASKED` is what wasn't asked for."""

    colours: np.ndarray = NOT_ASKED  # (height, width, 3) of uint8, without noise
    # (height, width) along the optical axis [m]; inf: nothing within the clips
    depths: np.ndarray = NOT_ASKED
    image: np.ndarray = NOT_ASKED  # the colours with noise


class PinholeCamera:
    """A camera, made from a `<camera>`; `pose` is that of what holds it in `link`, `where` is for errors.

    `across` (width,) and `down` (height, 1) are a pixel's point to the right and down, for each metre of
    depth. Raises DescriptionError if it can't be simulated. Pictures have `scale` times the size that the
    file says.
    """

    def __init__(self, element: Element, pose: Pose, where: str, link: str, scale: float = 1.0) -> None:
        self.link = link
        self.pose = pose.compose(read_pose(element, f"{where}, <camera>")[0])
        self.width, self.height = (
            max(1, round(scale * _pixels(element, f"image/{tag}", where, default)))
            for tag, default in (("width", 320), ("height", 240))
        )
        if self.width * self.height > MOST_PIXELS:
            raise DescriptionError(
                f"{where}: a picture of {self.width} x {self.height} has more than {MOST_PIXELS} pixels"
            )
        self.field_of_view = value(element, "horizontal_fov", where, 1.047)  # [rad]
        if not 0.0 < self.field_of_view < math.pi:
            raise DescriptionError(f"{where}: <horizontal_fov> is {self.field_of_view:g} rad")
        self.format = (element.findtext("image/format") or "R8G8B8").strip()
        self.near = value(element, "clip/near", where, 0.1)
        self.far = value(element, "clip/far", where, 100.0)
        if not 0.0 <= self.near < self.far <= FURTHEST:
            raise DescriptionError(f"{where}: <clip> is {self.near:g} to {self.far:g} m")
        self.noise: Noise | None = read_noise(element, where)
        self.focal_length = self.width / (2.0 * math.tan(self.field_of_view / 2.0))  # [pixels]
        self.across, down = (
            (np.arange(count) + 0.5 - count / 2.0) / self.focal_length for count in (self.width, self.height)
        )
        self.down = down[:, None]

    def picture(self, scene: RayCaster, link: Pose, in_colour: bool = True) -> CameraView:
        """Returns what the camera sees of visuals, without noise; black if not `in_colour`."""
        pose = link.compose(self.pose)
        shape = self.height, self.width
        seen = CameraView(np.zeros((*shape, 3), np.uint8), np.zeros(shape))
        rows = max(1, PIECE // self.width)
        for first in range(0, self.height, rows):
            piece = slice(first, first + rows)
            self._see(CameraView(*(each[piece] for each in seen)), piece, scene, pose, in_colour)
        return seen

    def _see(self, seen: CameraView, rows: slice, scene: RayCaster, pose: Pose, in_colour: bool) -> None:
        """Fills in some rows of a view."""
        turns, places = frames([pose])
        # By columns, along which NumPy is fast. The order of the sums, with left last, keeps their bits.
        left, up = -self.across, -self.down[rows]
        lengths = np.sqrt(1.0 + left * left + up * up)
        ahead = np.stack([1.0 / lengths, up / lengths, left / lengths]).reshape(3, -1)
        directions = np.einsum("ij,jk->ik", turns[0][:, [0, 2, 1]], ahead).T
        cosines = 1.0 / lengths.ravel()
        hits = scene.cast(places[0], directions, self.near / cosines, self.far / cosines)
        seen.depths[:] = (hits.distances * cosines).reshape(seen.depths.shape)
        if in_colour:
            seen.colours[:] = colours(scene, hits, places[0], directions).reshape(seen.colours.shape)


class Shot(NamedTuple):
    """What a picture is made of, then or later, here or in another process."""

    camera: PinholeCamera
    link: Pose  # of what carries the camera
    scene: SceneState
    image: bool = False  # whether that of the view is asked for
    colours: bool = False
    depths: bool = False
    noise: tuple[float, np.random.Generator] | None = None  # its bias, and what draws the rest

    @property
    def is_blank(self) -> bool:
        """Whether nothing is asked for."""
        return not (self.image or self.colours or self.depths)

    def finished(self, seen: CameraView) -> CameraView:
        """Returns the requested parts of a picture, its image with noise."""
        image, noise = seen.colours, self.camera.noise
        if self.image and noise is not None and self.noise is not None:
            image = noisy(image, noise, *self.noise)
        return CameraView(
            seen.colours if self.colours else NOT_ASKED,
            seen.depths if self.depths else NOT_ASKED,
            image if self.image else NOT_ASKED,
        )


def noisy(picture: np.ndarray, noise: Noise, bias: float, random: np.random.Generator) -> np.ndarray:
    """Returns a picture of uint8 with noise, whose unit is the whole range of a channel."""
    values = noise.applied(picture / 255.0, bias, random)
    return np.rint(255.0 * np.clip(values, 0.0, 1.0)).astype(np.uint8)


def _pixels(element: Element, path: str, where: str, default: int) -> int:
    count = value(element, path, where, default)
    if count != int(count) or not 1 <= count <= LONGEST_SIDE:
        raise DescriptionError(f"{where}: <{path}> is {count:g}; 1 to {LONGEST_SIDE} are possible")
    return int(count)
