"""Cameras of models, for tasks and plugins."""

import math
from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from robot_sim.physics.description import DescriptionError, Sensor, library_of
from robot_sim.sensors.pinhole import CameraView, PinholeCamera, Shot
from robot_sim.sensors.sensing import Field, Measurement, Mount, sensor_of, slower

KINECT = "libgazebo_ros_openni_kinect.so"
DEPTH_KINDS = ("depth", "depth_camera", "rgbd_camera")


def camera_of(sensor: Sensor, scale: float = 1.0) -> PinholeCamera:
    """Returns the only camera of a sensor; `scale` as of `PinholeCamera`.

    Raises DescriptionError if it has none, or it can't be simulated.
    """
    where = f"sensor '{sensor.name}'"
    element = sensor.element.find("camera")
    if element is None:
        raise DescriptionError(f"{where} has no <camera>")
    return PinholeCamera(element, sensor.pose, where, sensor.link, scale)


def shot_of(
    mount: Mount, camera: PinholeCamera, now: int, own: str = "", *,
    image: bool = False, colours: bool = False, depths: bool = False,
) -> Shot:  # fmt: skip
    """Returns the inputs of the picture at a time [ns]; `own` names one of several cameras."""
    random, part = None, f"/{own}"
    if image and camera.noise is not None:
        random = camera.noise.draw_bias(mount.biases(part)), mount.random(now, part)
    link = mount.model.link_state(camera.link)[0]
    scene = mount.sensing.visuals.scene.state()
    return Shot(camera, link, scene, image, colours, depths, random)


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

    def values(self, now: int) -> dict[str, np.ndarray]:
        shot = shot_of(self.mount, self.camera, now, image=True)
        return {"image": self.mount.sensing.renderer.picture(shot).image}


class DepthSensor(CameraSensor):
    """A depth camera. Of its plugin, `pointCloudCutoff` (0.4 m) is read, and a kinect's `pointCloudCutoffMax`
    (5 m)."""

    kinds = DEPTH_KINDS
    fields: ClassVar = {
        "depth": Field("(height, width) of float32 along the optical axis [m]; NaN beyond the cutoffs", True)
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
        shot = shot_of(self.mount, self.camera, now, depths=True)
        view = self.mount.sensing.renderer.picture(shot)
        return {"depth": self.depths(view).astype(np.float32)}


SENSORS = (CameraSensor, DepthSensor)
