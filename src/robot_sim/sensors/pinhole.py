"""Cameras: colours and depths of what lies before a pinhole (docs/contract/sensors.md 4)."""

import math
from collections.abc import Sequence
from typing import ClassVar, NamedTuple
from xml.etree.ElementTree import Element

import numpy as np

from robot_sim.physics.description import DescriptionError, Sensor, library_of
from robot_sim.physics.files.sdf_parts import read_pose, value
from robot_sim.physics.pose import Pose
from robot_sim.sensors.frames import frames
from robot_sim.sensors.noise import Noise, read_noise
from robot_sim.sensors.rays import RayScene
from robot_sim.sensors.sensing import FURTHEST, Field, Measurement, Mount, sensor_of, slower
from robot_sim.sensors.shading import colours

KINECT = "libgazebo_ros_openni_kinect.so"
DEPTH_KINDS = ("depth", "depth_camera", "rgbd_camera")
MOST_PIXELS = 2_100_000  # full HD: services wait while a picture is made
LONGEST_SIDE = 65_500  # of a JPEG
PIECE = 1 << 17  # pixels that are looked at together


class CameraView(NamedTuple):
    """What a camera sees."""

    colours: np.ndarray  # (height, width, 3) of uint8
    depths: np.ndarray  # (height, width) along the optical axis [m]; inf: nothing within the clips


class PinholeCamera:
    """A camera, made from a `<camera>`; `pose` is that of what holds it in `link`, `where` is for errors.

    `across` (width,) and `down` (height, 1) are a pixel's point to the right and down, for each metre of
    depth. Raises DescriptionError if it can't be simulated. Pictures have `scale` times the size that the
    file says.
    """

    def __init__(
        self, element: Element, pose: Pose, where: str, link: str, scale: float = 1.0
    ) -> None:
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
            (np.arange(count) + 0.5 - count / 2.0) / self.focal_length
            for count in (self.width, self.height)
        )
        self.down = down[:, None]

    def picture(self, scene: RayScene, link: Pose, in_colour: bool = True) -> CameraView:
        """Returns what the camera sees of visuals, without noise; black if not `in_colour`."""
        pose = link.compose(self.pose)
        shape = self.height, self.width
        seen = CameraView(np.zeros((*shape, 3), np.uint8), np.zeros(shape))
        rows = max(1, PIECE // self.width)
        for first in range(0, self.height, rows):
            piece = slice(first, first + rows)
            self._see(CameraView(*(each[piece] for each in seen)), piece, scene, pose, in_colour)
        return seen

    def _see(
        self, seen: CameraView, rows: slice, scene: RayScene, pose: Pose, in_colour: bool
    ) -> None:
        """Fills in some rows of a view."""
        turns, places = frames([pose])
        axes = np.broadcast_arrays(1.0, -self.across, -self.down[rows])
        ahead = np.stack(axes, axis=-1).reshape(-1, 3)
        lengths = np.linalg.norm(ahead, axis=1)
        directions = np.einsum("ij,kj->ki", turns[0], ahead / lengths[:, None])
        cosines = 1.0 / lengths
        hits = scene.cast(places[0], directions, self.near / cosines, self.far / cosines)
        seen.depths[:] = (hits.distances * cosines).reshape(seen.depths.shape)
        if in_colour:
            found = colours(scene, hits, places[0], directions)
            seen.colours[:] = np.rint(np.clip(found, 0.0, 255.0)).reshape(seen.colours.shape)


def noisy(
    picture: np.ndarray, noise: Noise, bias: float, random: np.random.Generator
) -> np.ndarray:
    """Returns a picture of uint8 with noise, whose unit is the whole range of a channel."""
    values = noise.applied(picture / 255.0, bias, random)
    return np.rint(255.0 * np.clip(values, 0.0, 1.0)).astype(np.uint8)


def camera_of(sensor: Sensor, scale: float = 1.0) -> PinholeCamera:
    """Returns the only camera of a sensor; `scale` as of `PinholeCamera`.

    Raises DescriptionError if it has none, or it can't be simulated.
    """
    where = f"sensor '{sensor.name}'"
    element = sensor.element.find("camera")
    if element is None:
        raise DescriptionError(f"{where} has no <camera>")
    return PinholeCamera(element, sensor.pose, where, sensor.link, scale)


def with_noise(
    mount: Mount, camera: PinholeCamera, picture: np.ndarray, now: int, own: str = ""
) -> np.ndarray:
    """Returns a camera's picture at a time [ns] with its noise; `own` names one of several cameras."""
    noise, part = camera.noise, f"/{own}"
    if noise is None:
        return picture
    return noisy(picture, noise, noise.draw_bias(mount.biases(part)), mount.random(now, part))


def rate_of(mount: Mount, sensor: Sensor) -> float:
    """Returns the slower one of a plugin's `<updateRate>` and the sensor's rate [Hz]; 0 is every step."""
    return slower(mount.rate(), sensor.rate)


class CameraSensor(Measurement):
    """A camera on a model."""

    non_persistent = ("_sensor", "camera")
    kinds: ClassVar[Sequence[str]] = ("camera",)
    fields: ClassVar = {"image": Field("(height, width, 3) of uint8: red, green and blue", True)}

    def __init__(self, mount: Mount) -> None:
        super().__init__(mount)
        self._sensor = sensor_of(mount, self.kinds)
        self.camera = camera_of(self._sensor, mount.sensing.camera_scale)
        self.rate = rate_of(mount, self._sensor)

    def view(self, in_colour: bool = True) -> CameraView:
        """Returns what it sees now, without noise."""
        link = self.mount.model.link_state(self._sensor.link)[0]
        return self.camera.picture(self.mount.sensing.visuals, link, in_colour)

    def values(self, now: int) -> dict[str, np.ndarray]:
        return {"image": with_noise(self.mount, self.camera, self.view().colours, now)}


class DepthSensor(CameraSensor):
    """A depth camera. Of its plugin, `pointCloudCutoff` (0.4 m) is read, and a kinect's `pointCloudCutoffMax`
    (5 m)."""

    kinds = DEPTH_KINDS
    fields: ClassVar = {
        "depth": Field(
            "(height, width) of float32 along the optical axis [m]; NaN beyond the cutoffs", True
        )
    }

    def __init__(self, mount: Mount) -> None:
        super().__init__(mount)
        has_end = library_of(mount.plugin.filename) == KINECT
        self._low = mount.number("pointCloudCutoff", 0.4 if mount.plugin.filename else 0.0)
        self._high = mount.number("pointCloudCutoffMax", 5.0) if has_end else math.inf

    def depths(self, view: CameraView) -> np.ndarray:
        """Returns depths (height, width) within the cutoffs [m]; NaN for others."""
        depths = np.minimum(view.depths, self.camera.far)
        depths[(depths <= self._low) | (depths > self._high)] = np.nan
        return depths

    def values(self, now: int) -> dict[str, np.ndarray]:
        return {"depth": self.depths(self.view(in_colour=False)).astype(np.float32)}


def _pixels(element: Element, path: str, where: str, default: int) -> int:
    count = value(element, path, where, default)
    if count != int(count) or not 1 <= count <= LONGEST_SIDE:
        raise DescriptionError(f"{where}: <{path}> is {count:g}; 1 to {LONGEST_SIDE} are possible")
    return int(count)


SENSORS = (CameraSensor, DepthSensor)
