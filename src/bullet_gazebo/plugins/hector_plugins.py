"""hector's IMU, GPS, magnetometer and sonar, whose errors drift (docs/contract/sensors.md 12.1)."""

import math
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from typing import Any

import numpy as np
import rospy
from dynamic_reconfigure.encoding import Config
from geometry_msgs.msg import Quaternion, Vector3, Vector3Stamped
from hector_gazebo_plugins.srv import SetBias
from sensor_msgs.msg import Imu as ImuMsg
from sensor_msgs.msg import MagneticField, NavSatFix, NavSatStatus, Range
from std_msgs.msg import Header
from std_srvs.srv import Empty

from bullet_gazebo.common.dynamic_server import FIRST, DynamicServer, Parameter
from bullet_gazebo.common.messages import to_time
from bullet_gazebo.plugins.plugin_loader import PluginContext
from bullet_gazebo.plugins.sensor_topics import (
    ContextPlugin,
    advertised,
    namespace_of,
    offer_shared,
    topic_in,
)
from robot_sim.constants import NANOSECONDS
from robot_sim.physics.files.elements import numbers, truth
from robot_sim.physics.pose import conjugate, from_rpy, multiply, rotate
from robot_sim.sensors.drift import DriftingError
from robot_sim.sensors.imu import Imu, LinkMotion, motion_of
from robot_sim.sensors.laser import LaserSensor, nearest
from robot_sim.sensors.noise import checked_deviation

MOST = 1e6  # that dynamic_reconfigure sets
EQUATOR = 6378137.0  # [m], radius of WGS84
FLATTENING = 1.0 / 298.257223563
GRAVITY = 9.8065  # [m/s²]
ATTRIBUTES = {
    "gaussian_noise": "noise", "offset": "offset", "drift": "drift", "drift_frequency": "frequency",
    "scale_error": "scale",
}  # fmt: skip
MODEL = [
    Parameter(name, "double", 0.0, 0.0 if name == "drift_frequency" else -MOST, MOST) for name in ATTRIBUTES
]


class HectorPlugin(ContextPlugin):
    """Base of sensors that publish without subscribers, too; subclasses call `begin`, and have `publish`."""

    non_persistent = ("_errors",)
    default_rate = 0.0  # [Hz]; 0 is every step

    def __init__(self, context: PluginContext) -> None:
        self.context = context
        self.namespace = namespace_of(context, absent="", empty="")
        period = context.number("updatePeriod", 0.0)
        self.rate = 1.0 / period if period > 0.0 else context.rate("updateRate", self.default_rate)

    def begin(self, *errors: DriftingError) -> None:
        """Publishes from now on; the drift of errors begins again when time does, and with a new seed."""
        context = self.context
        self._errors, self._seeds, self._last = errors, context.sensing.seeds, context.sim.now
        clock = context.clock(self.rate, self._measure, at_once=False)
        ticks = max(clock.period, 1)
        offset = math.fmod(context.number("updateOffset", 0.0), ticks / NANOSECONDS)
        clock.set_rate(self.rate, round(offset * NANOSECONDS) - ticks, self._last)

    def random(self, now: int) -> np.random.Generator:
        """Returns what draws the errors of a measurement at a time [ns]."""
        return self.context.sensing.noise(self.context.model, self.context.key, now)

    def _measure(self, now: int) -> None:
        seeds = self.context.sensing.seeds
        if now < self._last or seeds != self._seeds:
            self._seeds = seeds
            for error in self._errors:
                error.restart()
        seconds = max(now - self._last, 0) / NANOSECONDS
        self._last = now
        self.publish(now, seconds)

    def publish(self, now: int, seconds: float) -> None:
        """Publishes the measurement at a time [ns], some time [s] after the last one."""
        raise NotImplementedError


class HectorSensor(HectorPlugin):
    """One that measures the motion of a link."""

    def __init__(self, context: PluginContext) -> None:
        super().__init__(context)
        self.link = context.link("bodyName", required=False)
        self.frame = context.text("frameId", context.text("bodyName", self.link)).lstrip("/")

    @property
    def motion(self) -> LinkMotion:
        """That of the link."""
        return motion_of(self.context.model, self.link)


class HectorImuPlugin(HectorSensor):
    """Feels gravity: +9.8 m/s² upwards at rest."""

    def __init__(self, context: PluginContext) -> None:
        super().__init__(context)
        self._accel, self._spin, self._yaw = (
            DriftingError(_reader(context), prefix) for prefix in ("accel", "rate", "yaw")
        )
        self._turn = from_rpy(*numbers(context.text("rpyOffset", "0 0 0"), "<rpyOffset>", 3))
        self.begin(self._accel, self._spin, self._yaw)
        self._imu = Imu(True, self.rate)
        topic = topic_in(self.namespace, context.text("topicName", "imu"))
        bias = topic_in(self.namespace, context.text("biasTopicName", f"{topic}/bias"))
        self._publisher, self._bias = (advertised(context, name, ImuMsg, 10) for name in (topic, bias))
        calibrate = context.text("serviceName", f"{topic}/calibrate")
        self._offer(topic_in(self.namespace, calibrate), Empty, self._spin)
        self._offer(f"{topic}/set_accel_bias", SetBias, self._accel)
        self._offer(f"{topic}/set_rate_bias", SetBias, self._spin)
        for name, error in (("accel", self._accel), ("rate", self._spin), ("yaw", self._yaw)):
            with suppress(rospy.ServiceException):
                server = DynamicServer(MODEL, partial(self._configure, error), f"{topic}/{name}")
                context.closing(server.shutdown)

    def _offer(self, name: str, kind: Any, error: DriftingError) -> None:
        """Offers a service that sets the drift of `error`: to zero if the request has no bias."""

        def answer(request: Any) -> Any:
            vector = getattr(request, "bias", Vector3())
            bias = (vector.x, vector.y, vector.z)
            if not all(map(math.isfinite, bias)):
                raise rospy.ServiceException(f"the bias is not finite: {bias}")
            with self.context.sim.lock:
                error.restart(bias)
            return kind._response_class()

        offer_shared(self.context, name, kind, answer)

    def _configure(self, error: DriftingError, wanted: Config, level: int) -> Config:
        """Sets an error model; the first call asks for the file's, a number that isn't finite is left out."""
        with self.context.sim.lock:
            for name, attribute in ATTRIBUTES.items():
                if level == FIRST or not math.isfinite(wanted[name]):
                    wanted[name] = float(getattr(error, attribute)[0])
                else:
                    setattr(error, attribute, np.full(3, wanted[name]))
        return wanted

    def publish(self, now: int, seconds: float) -> None:
        sim, model, motion = self.context.sim, self.context.model, self.motion
        moves, _ = self.context.sensing.schedule.last_move(model)
        # The offset turns the axes of all that is measured, not just the orientation.
        pose = motion.pose._replace(orientation=multiply(self._turn, motion.pose.orientation))
        sample = self._imu.measure(now, moves, motion._replace(pose=pose), sim.world.gravity)
        if sample is None:
            return
        random = self.random(now)
        acceleration = self._accel.applied(np.array(sample.linear_acceleration), seconds, random)
        rate = self._spin.applied(np.array(sample.angular_velocity), seconds, random)
        yaw = float(self._yaw.applied(np.zeros(3), seconds, random)[2])
        turned = multiply(from_rpy(0.0, 0.0, yaw), sample.orientation)
        tilt = self._accel.noise[:2] ** 2 / GRAVITY**2
        header = Header(stamp=to_time(now), frame_id=self.frame)
        if self._bias.has_subscribers:
            drifts = (Vector3(*error.bias) for error in (self._spin, self._accel))
            bias = ImuMsg(header=header, orientation=Quaternion(w=1.0))
            bias.angular_velocity, bias.linear_acceleration = drifts
            self._bias.publish(bias)
        self._publisher.publish(
            ImuMsg(
                header=header,
                orientation=Quaternion(*turned),
                orientation_covariance=_diagonal([*tilt, self._yaw.noise[2] ** 2]),
                angular_velocity=Vector3(*rate),
                angular_velocity_covariance=_diagonal(self._spin.noise**2),
                linear_acceleration=Vector3(*acceleration),
                linear_acceleration_covariance=_diagonal(self._accel.noise**2),
            )
        )


class HectorGpsPlugin(HectorSensor):
    """Latitude, longitude [degrees] and altitude [m] on WGS84; velocities north, west and up [m/s]."""

    default_rate = 4.0

    def __init__(self, context: PluginContext) -> None:
        super().__init__(context)
        self._latitude, self._longitude, heading, self._altitude = (
            context.number(f"reference{name}", default)
            for name, default in (("Latitude", 49.9), ("Longitude", 8.9), ("Heading", 0.0), ("Altitude", 0.0))
        )
        self._heading = math.radians(heading)
        sine = math.sin(math.radians(self._latitude))
        squared = FLATTENING * (2.0 - FLATTENING)
        share = 1.0 - squared * sine**2
        self._north = EQUATOR * (1.0 - squared) / share**1.5  # [m/rad]
        self._east = EQUATOR / math.sqrt(share) * math.cos(math.radians(self._latitude))
        self._error = DriftingError(_reader(context), "")
        self._velocity_error = DriftingError(_reader(context), "velocity")
        self.begin(self._error, self._velocity_error)
        self._frame = context.text("frameId", "/world")
        fix = topic_in(self.namespace, context.text("topicName", "fix"))
        self._fix = advertised(context, fix, NavSatFix, 10)
        velocity = topic_in(self.namespace, context.text("velocityTopicName", "fix_velocity"))
        self._velocity = advertised(context, velocity, Vector3Stamped, 10)

    def publish(self, now: int, seconds: float) -> None:
        random, motion = self.random(now), self.motion
        place = self._error.applied(np.array(motion.pose.position), seconds, random)
        speed = self._velocity_error.applied(np.array(motion.linear), seconds, random)
        north, west = self._turned(place)
        header = Header(stamp=to_time(now), frame_id=self._frame)
        self._fix.publish(
            NavSatFix(
                header=header,
                status=NavSatStatus(NavSatStatus.STATUS_FIX, 0),
                latitude=self._latitude + math.degrees(north / self._north),
                longitude=self._longitude - math.degrees(west / self._east),
                altitude=self._altitude + float(place[2]),
                position_covariance=_diagonal(self._error.drift**2 + self._error.noise**2),
                position_covariance_type=NavSatFix.COVARIANCE_TYPE_DIAGONAL_KNOWN,
            )
        )
        self._velocity.publish(Vector3Stamped(header, Vector3(*self._turned(speed), float(speed[2]))))

    def _turned(self, values: np.ndarray) -> tuple[float, float]:
        """Returns the parts to the north and to the west."""
        x, y = float(values[0]), float(values[1])
        cosine, sine = math.cos(self._heading), math.sin(self._heading)
        return x * cosine + y * sine, -x * sine + y * cosine


class HectorMagneticPlugin(HectorSensor):
    """The magnetic field of the earth in the sensor's axes, scaled to `magnitude`."""

    def __init__(self, context: PluginContext) -> None:
        super().__init__(context)

        def angle(tag: str, default: float) -> float:
            return math.radians(context.number(tag, default))

        declination, inclination = angle("declination", 0.0), angle("inclination", 60.0)
        heading = angle("referenceHeading", 0.0)
        across = context.number("magnitude", 1.0) * math.cos(inclination)
        down = -context.number("magnitude", 1.0) * math.sin(inclination)
        turn = heading - declination
        self._field = (across * math.cos(turn), across * math.sin(turn), down)
        self._error = DriftingError(_reader(context), "")
        self.begin(self._error)
        self._is_field = truth(context.text("useMagneticFieldMsgs", "false"))
        topic = topic_in(self.namespace, context.text("topicName", "magnetic"))
        kind = MagneticField if self._is_field else Vector3Stamped
        self._publisher = advertised(context, topic, kind, 1)

    def publish(self, now: int, seconds: float) -> None:
        field = rotate(conjugate(self.motion.pose.orientation), self._field)
        seen = Vector3(*self._error.applied(np.array(field), seconds, self.random(now)))
        header = Header(stamp=to_time(now), frame_id=self.frame)
        message = MagneticField(header, seen, [0.0] * 9) if self._is_field else Vector3Stamped(header, seen)
        self._publisher.publish(message)


class HectorSonarPlugin(HectorPlugin):
    """The nearest range of a laser's rays."""

    default_rate = 10.0

    def __init__(self, context: PluginContext) -> None:
        super().__init__(context)
        self._sensor = LaserSensor(context)
        self._error = DriftingError(_reader(context), "")
        self.begin(self._error)
        self._frame = context.text("frameId", "/sonar_link")
        topic = topic_in(self.namespace, context.text("topicName", "sonar"))
        self._publisher = advertised(context, topic, Range, 1)
        context.show(topic, Range, self._sensor.sensor.link, self._sensor.sensor.pose)

    def publish(self, now: int, seconds: float) -> None:
        laser, random = self._sensor.laser, self.random(now)
        exact = nearest(self._sensor.scan(random), laser, 0.0, random)
        measured = float(self._error.applied(np.full(3, exact), seconds, random)[0])
        self._publisher.publish(
            Range(
                header=Header(stamp=to_time(now), frame_id=self._frame),
                radiation_type=Range.ULTRASOUND,
                field_of_view=min(fan.high - fan.low for fan in (laser.horizontal, laser.vertical)),
                min_range=laser.low,
                max_range=laser.high,
                range=min(max(measured, laser.low), laser.high),
            )
        )


def _reader(context: PluginContext) -> Callable[[str, float], np.ndarray]:
    """Returns a reader of elements with one number or three."""

    def read(tag: str, default: float) -> np.ndarray:
        words = context.text(tag, str(default)).split()
        count = 1 if len(words) == 1 else 3
        values = numbers(" ".join(words), f"<{tag}>", count)
        for number in values:
            checked_deviation(abs(number), f"<{tag}>")
        return np.broadcast_to(values, 3)

    return read


def _diagonal(values: np.ndarray | list[float]) -> list[float]:
    return [float(each) for each in np.diag(values).ravel()]


LIBRARIES = {
    "libhector_gazebo_ros_imu.so": HectorImuPlugin,
    "libhector_gazebo_ros_gps.so": HectorGpsPlugin,
    "libhector_gazebo_ros_magnetic.so": HectorMagneticPlugin,
    "libhector_gazebo_ros_sonar.so": HectorSonarPlugin,
}
