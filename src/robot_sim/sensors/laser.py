"""Lasers: ranges along a fan or grid of rays (docs/contract/sensors.md 2)."""

import math
from collections.abc import Sequence
from functools import cached_property
from typing import ClassVar, NamedTuple
from xml.etree.ElementTree import Element

import numpy as np

from robot_sim.physics.description import DescriptionError, Sensor
from robot_sim.physics.files.sdf_parts import value
from robot_sim.physics.pose import Pose
from robot_sim.sensors.frames import frames
from robot_sim.sensors.noise import Noise, read_noise
from robot_sim.sensors.rays import RayScene
from robot_sim.sensors.scene import FURTHEST
from robot_sim.sensors.sensing import Field, Measurement, Mount, sensor_of, sensor_pose, slower

KINDS = ("ray", "gpu_ray", "lidar", "gpu_lidar")
RENDERED = ("gpu_ray", "gpu_lidar")  # they see visuals, the others collisions
MOST_RAYS = 1_000_000


class Scan(NamedTuple):
    """A laser's readings, lowest row first: ranges [m] and intensities, each (rows, columns)."""

    ranges: np.ndarray
    intensities: np.ndarray


class Fan(NamedTuple):
    """The angles of a scan in one direction."""

    samples: int  # rays
    readings: int
    low: float  # [rad]
    high: float  # [rad]

    @property
    def increment(self) -> float:
        """The angle between two readings [rad]; 0 for one alone."""
        return (self.high - self.low) / (self.readings - 1) if self.readings > 1 else 0.0

    def angles(self, count: int) -> np.ndarray:
        """Returns the angles of so many rays or readings [rad]: 0 for one alone."""
        return np.linspace(self.low, self.high, count) if count > 1 else np.zeros(1)


class Laser:
    """A laser scanner, of one of `KINDS`; raises DescriptionError if it can't be simulated."""

    def __init__(self, sensor: Sensor) -> None:
        where = f"sensor '{sensor.name}'"
        ray = sensor.element.find("ray")
        ray = sensor.element.find("lidar") if ray is None else ray
        if ray is None:
            raise DescriptionError(f"{where} has no <ray>")
        self.sees_visuals = sensor.kind in RENDERED
        self.horizontal = _fan(ray, "horizontal", where, 640)
        self.vertical = _fan(ray, "vertical", where, 1)
        rays = self.horizontal.samples * self.vertical.samples
        readings = self.horizontal.readings * self.vertical.readings
        if max(rays, readings) > MOST_RAYS:
            raise DescriptionError(f"{where} has {rays} rays; up to {MOST_RAYS} are cast (MOST_RAYS)")
        self.low = value(ray, "range/min", where, 0.0)
        self.high = value(ray, "range/max", where, 0.0)
        if not 0.0 <= self.low < self.high <= FURTHEST:
            raise DescriptionError(
                f"{where}: <range> is {self.low:g} to {self.high:g} m; it must rise, from 0 to {FURTHEST:g}"
            )
        self.noise: Noise | None = read_noise(ray, where)

    @cached_property
    def _rays(self) -> np.ndarray:
        fans = self.horizontal, self.vertical
        return _directions(*(fan.angles(fan.samples) for fan in fans)).reshape(-1, 3)

    @cached_property
    def directions(self) -> np.ndarray:
        """The directions of the readings in the sensor's axes: (rows, columns, 3), of length 1."""
        fans = self.horizontal, self.vertical
        return _directions(*(fan.angles(fan.readings) for fan in fans))

    def measure(self, scene: RayScene, pose: Pose, bias: float, random: np.random.Generator | None) -> Scan:
        """Measures from `pose` in the world, with the noise's bias [m].

        The scene has collisions or visuals, see `sees_visuals`. Ranges are within the limits; inf for nothing
        within reach, -inf for something nearer than the lower limit.
        """
        turns, places = frames([pose])
        directions = np.einsum("ij,kj->ki", turns[0], self._rays)
        hits = scene.cast(places[0], directions, self.low, self.high)
        shape = self.vertical.samples, self.horizontal.samples
        ranges, intensities = (hits.distances.reshape(shape), scene.retro[hits.targets].reshape(shape))
        for axis, fan in enumerate((self.vertical, self.horizontal)):
            ranges, intensities = (_resampled(each, fan, axis) for each in (ranges, intensities))
        beyond, before = ranges >= self.high, ranges <= self.low
        if self.noise is not None and random is not None:
            noisy = self.noise.applied(np.minimum(ranges, self.high), bias, random)
            ranges = np.clip(noisy, self.low, self.high)
        ranges = np.where(beyond, np.inf, np.where(before, -np.inf, ranges))
        return Scan(ranges, intensities)


RANGES = Field("(n,) of float32 [m], the lowest row first; inf for nothing, -inf for too near", True)


class LaserSensor(Measurement):
    """A laser on a model."""

    kinds: ClassVar[Sequence[str]] = KINDS
    non_persistent = ("sensor", "laser", "_scene")
    fields: ClassVar = {
        "ranges": RANGES,
        "intensities": Field("(n,) of float32: the `laser_retro` of what each ray has met"),
    }

    def __init__(self, mount: Mount) -> None:
        super().__init__(mount)
        self.sensor = sensor_of(mount, KINDS)
        self.laser = Laser(self.sensor)
        self.rate = self.sensor.rate
        sensing = mount.sensing
        self._scene = sensing.visuals if self.laser.sees_visuals else sensing.collisions

    def measure(self, now: int) -> Scan:
        """Returns a scan at a time [ns]."""
        return self.scan(None if self.laser.noise is None else self.mount.random(now))

    def scan(self, random: np.random.Generator | None) -> Scan:
        """Returns a scan, whose noise, if it has any, is drawn from `random`."""
        mount, noise = self.mount, self.laser.noise
        bias = 0.0 if noise is None else noise.draw_bias(mount.biases())
        return self.laser.measure(self._scene, sensor_pose(mount.model, self.sensor), bias, random)

    def values(self, now: int) -> dict[str, np.ndarray]:
        scan = self.measure(now)
        return {name: each.astype(np.float32).ravel() for name, each in scan._asdict().items()}


class RangeSensor(LaserSensor):
    """The nearest ray of a laser. Of its plugin, `gaussianNoise` (0 m) and `updateRate` (0 Hz) are read."""

    kinds = ()
    libraries = ("libgazebo_ros_range.so",)
    fields: ClassVar = {"ranges": RANGES}

    def __init__(self, mount: Mount) -> None:
        super().__init__(mount)
        self.rate = slower(mount.rate(), self.rate)
        self._deviation = mount.deviation()

    def nearest(self, now: int) -> float:
        """Returns the smallest range at a time [ns], at most the largest that it measures [m]."""
        random = self.mount.random(now)
        return nearest(self.scan(random), self.laser, self._deviation, random)

    def values(self, now: int) -> dict[str, np.ndarray]:
        return {"ranges": np.array([self.nearest(now)], np.float32)}


def nearest(scan: Scan, laser: Laser, deviation: float, random: np.random.Generator) -> float:
    """Returns the smallest range of a scan [m], with noise if it is below the largest."""
    found = float(np.clip(scan.ranges.min(), laser.low, laser.high))
    if found < laser.high and deviation:
        found += float(random.normal(0.0, deviation))
    return min(found, laser.high)


def _directions(yaws: np.ndarray, pitches: np.ndarray) -> np.ndarray:
    yaw, pitch = np.meshgrid(yaws, pitches)
    return np.stack([np.cos(pitch) * np.cos(yaw), np.cos(pitch) * np.sin(yaw), np.sin(pitch)], axis=-1)


def _fan(ray: Element, name: str, where: str, samples: int) -> Fan:
    scan = ray.find(f"scan/{name}")
    where = f"{where}, <{name}>"
    count = value(scan, "samples", where, samples)
    resolution = value(scan, "resolution", where, 1.0)
    low, high = (value(scan, tag, where, 0.0) for tag in ("min_angle", "max_angle"))
    readings = round(count * resolution) if abs(count * resolution) <= MOST_RAYS else 0
    if not 1 <= count <= MOST_RAYS or count != int(count) or readings < 1:
        raise DescriptionError(
            f"{where}: {count:g} samples at a resolution of {resolution:g}; 1 to {MOST_RAYS} are cast"
        )
    if low > high or not -2.0 * math.pi <= low <= high <= 4.0 * math.pi:
        raise DescriptionError(f"{where}: the angles {low:g} to {high:g} rad are no scan")
    return Fan(int(count), readings, low, high)


def _resampled(values: np.ndarray, fan: Fan, axis: int) -> np.ndarray:
    """Interpolates between rays where a scan has another number of readings."""
    if fan.samples == fan.readings:
        return values
    at = np.linspace(0.0, fan.samples - 1, fan.readings)
    low = at.astype(int)
    high = np.minimum(low + 1, fan.samples - 1)
    share = np.expand_dims(at - low, 1 - axis)
    before, after = values.take(low, axis), values.take(high, axis)
    with np.errstate(invalid="ignore"):  # between two rays that meet nothing: inf - inf
        between = before + share * (after - before)
    return np.where(share == 0.0, before, np.where(np.isnan(between), np.inf, between))


SENSORS = (LaserSensor, RangeSensor)
