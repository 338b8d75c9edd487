"""Inertial measurement units (docs/contract/sensors.md 3)."""

from collections.abc import Sequence
from typing import ClassVar, NamedTuple

import numpy as np

from robot_sim.constants import NANOSECONDS
from robot_sim.control.hardware import IMU
from robot_sim.physics.files.elements import numbers, truth
from robot_sim.physics.model import Model
from robot_sim.physics.pose import (
    Pose,
    Quaternion,
    Vector,
    add,
    conjugate,
    cross,
    from_rpy,
    multiply,
    rotate,
    scale,
    subtract,
)
from robot_sim.sensors.noise import read_noise
from robot_sim.sensors.sensing import Field, Measurement, Mount, sensor_of, slower
from robot_sim.state_dict import Stateful

HERE = Pose()
LONGEST_STEP = 0.01  # [s]


class LinkMotion(NamedTuple):
    """Where a frame is in the world, and how fast [m/s], [rad/s], in world axes."""

    pose: Pose
    linear: Vector
    angular: Vector


class InertialSample(NamedTuple):
    """What an IMU measures, in its own axes: angular velocity [rad/s], linear acceleration [m/s²]."""

    orientation: Quaternion  # of the sensor in the world
    angular_velocity: Vector
    linear_acceleration: Vector


def motion_of(model: Model, link: str, offset: Pose = HERE) -> LinkMotion:
    """Returns the motion of the frame at `offset` in a link."""
    pose, (linear, angular) = model.link_state(link)
    at = pose.compose(offset)
    lever = subtract(at.position, pose.position)
    return LinkMotion(at, add(linear, cross(angular, lever)), angular)


class Imu(Stateful):
    """Derives accelerations from the velocities of two measurements.

    Args:
        feels_gravity: Whether it measures +9.8 m/s² upwards at rest, as real ones do.
        rate: Of the measurements [Hz]; 0 is every step. An older one is not compared with.
    """

    def __init__(self, feels_gravity: bool, rate: float = 0.0) -> None:
        self._feels_gravity = feels_gravity
        self._longest = 1.5 * NANOSECONDS * max(1.0 / rate if rate else 0.0, LONGEST_STEP)  # [ns]
        self._last: tuple[int, int, Vector] | None = None  # time [ns], moves, velocity [m/s]

    def start(self) -> None:
        """Begins at rest, unless it has begun, so that the next measurement can be compared."""
        self._last = self._last or (0, -1, (0.0, 0.0, 0.0))

    def measure(self, now: int, moves: int, motion: LinkMotion, gravity: Vector) -> InertialSample | None:
        """Returns a measurement; None for the first one, which has none to compare with.

        Args:
            now: Time [ns].
            moves: Counts what has moved bodies besides time: across such a move there is no acceleration.
            motion, gravity: Of the sensor, and of the world [m/s²].
        """
        last, self._last = self._last, (now, moves, motion.linear)
        if last is None or (last[1] == moves and now - last[0] > self._longest):
            return None
        acceleration: Vector = (0.0, 0.0, 0.0)
        if moves == last[1] and now > last[0]:
            seconds = (now - last[0]) / NANOSECONDS
            acceleration = scale(subtract(motion.linear, last[2]), 1.0 / seconds)
        if self._feels_gravity:
            acceleration = subtract(acceleration, gravity)
        back = conjugate(motion.pose.orientation)
        return InertialSample(
            motion.pose.orientation, rotate(back, motion.angular), rotate(back, acceleration)
        )


class ModelImu(Measurement):
    """The IMU of a model, which feels no gravity (docs/contract/sensors.md 3b).

    Of its plugin, `bodyName`, which is required, `updateRate` (0 Hz), `gaussianNoise` (0) and `rpyOffset` are
    read.
    """

    libraries: ClassVar[Sequence[str]] = ("libgazebo_ros_imu.so",)
    fields: ClassVar = {
        "orientation": Field("(4,): the quaternion (x, y, z, w) of the sensor in the world"),
        "angular_velocity": Field("(3,) in the sensor's axes [rad/s]", True),
        "linear_acceleration": Field("(3,) in the sensor's axes [m/s²]", True),
    }
    feels_gravity = False

    def __init__(self, mount: Mount) -> None:
        super().__init__(mount)
        self.deviation = mount.deviation()
        self._turn = from_rpy(*numbers(mount.text("rpyOffset", "0 0 0"), "<rpyOffset>", 3))
        self._model, self._link, self._offset = self._place(mount)
        self.rate = self._rate(mount)
        self._imu = Imu(self.feels_gravity, self.rate)

    def _place(self, mount: Mount) -> tuple[Model, str, Pose]:
        return (*mount.link_in_world("bodyName"), HERE)

    def _rate(self, mount: Mount) -> float:
        return mount.rate()

    def start(self) -> None:
        """Makes the first measurement one without acceleration."""
        self._imu.start()

    def measure(self, now: int) -> InertialSample | None:
        """Returns a measurement at a time [ns]; None for the first one."""
        mount = self.mount
        motion = motion_of(self._model, self._link, self._offset)
        moves, _ = mount.sensing.schedule.last_move(self._model)
        sample = self._imu.measure(now, moves, motion, mount.sim.world.gravity)
        if sample is None:
            return None
        sample = sample._replace(orientation=multiply(self._turn, sample.orientation))
        random = mount.random(now)
        return with_noise(self._distorted(sample, random), self.deviation, random)

    def _distorted(self, sample: InertialSample, random: np.random.Generator) -> InertialSample:
        return sample

    def values(self, now: int) -> dict[str, np.ndarray] | None:
        sample = self.measure(now)
        return sample and {name: np.array(each) for name, each in sample._asdict().items()}


class ImuSensor(ModelImu):
    """A sensor of type imu, which feels gravity (docs/contract/sensors.md 3a).

    Of its plugin, `updateRateHZ` (1), `gaussianNoise` (0), `rpyOffset` and `initialOrientationAsReference`
    (false) are read.
    """

    kinds = ("imu",)
    non_persistent = ("_noise",)
    libraries = ()
    interface = IMU
    feels_gravity = True

    def _place(self, mount: Mount) -> tuple[Model, str, Pose]:
        sensor = sensor_of(mount, ("imu",))
        if truth(mount.text("initialOrientationAsReference", "false")):
            start = motion_of(mount.model, sensor.link, sensor.pose).pose.orientation
            self._turn = multiply(self._turn, conjugate(start))
        self._noise = [
            (part, axis, noise)
            for part in ("angular_velocity", "linear_acceleration")
            for axis, letter in enumerate("xyz")
            if (noise := read_noise(sensor.element.find(f"imu/{part}/{letter}"), f"<imu>, <{part}>"))
        ]
        return mount.model, sensor.link, sensor.pose

    def _rate(self, mount: Mount) -> float:
        assert mount.sensor is not None
        return slower(mount.rate("updateRateHZ", 1.0 if mount.plugin.filename else 0.0), mount.sensor.rate)

    def _distorted(self, sample: InertialSample, random: np.random.Generator) -> InertialSample:
        biases = self.mount.biases() if self._noise else random
        for part, axis, noise in self._noise:
            values = list(getattr(sample, part))
            values[axis] = float(noise.applied(values[axis], noise.draw_bias(biases), random))
            sample = sample._replace(**{part: tuple(values)})
        return sample


def with_noise(sample: InertialSample, deviation: float, random: np.random.Generator) -> InertialSample:
    """Adds Gaussian noise of one deviation to all ten numbers; the quaternion keeps its length of 1."""
    if not deviation:
        return sample
    noisy = [
        [value + draw for value, draw in zip(part, random.normal(0.0, deviation, len(part)), strict=True)]
        for part in sample
    ]
    length = float(np.linalg.norm(noisy[0]))
    x, y, z, w = (value / length for value in noisy[0])
    (p, q, r), (u, v, s) = noisy[1:]
    return InertialSample((x, y, z, w), (p, q, r), (u, v, s))


SENSORS = (ModelImu, ImuSensor)
