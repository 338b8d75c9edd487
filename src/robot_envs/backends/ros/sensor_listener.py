"""Readings of a robot's sensors from their topics, in real time."""

import math
import threading
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from typing import Any, NamedTuple

import rospy
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Image

from bullet_gazebo.plugins.plugin_loader import built_in
from bullet_gazebo.plugins.sensor_topics import MODEL, TopicSource
from file_access.text import did_you_mean
from robot_envs.errors import RobotEnvError
from robot_envs.robot import Robot
from robot_envs.world_state import ODOMETRY, Motion, Pose, Reading, Sensors, Twist
from robot_sim.physics.description import DescriptionError, Plugin, library_of
from robot_sim.physics.files.sdf_parts import value
from robot_sim.physics.pose import normalized, rotate
from robot_sim.sensors.sensing import slower

Values = Mapping[str, Any]
LATE_PERIODS = 3  # of a sensor


def _motion(message: Odometry) -> Values:
    """Reads a vehicle's pose and, turned into the axes in which that is given, its speed."""
    at, speed = message.pose.pose, message.twist.twist
    place, turn, line, spin = at.position, at.orientation, speed.linear, speed.angular
    pose = Pose((place.x, place.y, place.z), (turn.x, turn.y, turn.z, turn.w))
    twist = Twist((line.x, line.y, line.z), (spin.x, spin.y, spin.z))
    numbers = (*pose.position, *pose.orientation, *twist.linear, *twist.angular)
    if not all(map(math.isfinite, numbers)) or not any(pose.orientation):
        raise ValueError(f"pose and speed are {numbers}")
    pose = Pose(pose.position, normalized(pose.orientation))
    return {ODOMETRY: Motion(pose, Twist(*(rotate(pose.orientation, each) for each in twist)))}


@cache
def sources() -> tuple[dict[str, TopicSource], dict[str, TopicSource]]:
    """Returns the sources of what tasks can see, by library and by the kind of the sensor."""
    plugins: dict[str, Any] = dict(built_in("LIBRARIES"))
    libraries: dict[str, TopicSource] = {}
    kinds: dict[str, TopicSource] = {}
    for library, plugin in plugins.items():
        source = getattr(plugin, "source", None)
        if source is not None and source.read is not None:
            libraries[library] = source
            for kind in plugin.measurement.kinds:
                kinds.setdefault(kind, source)
    return libraries, kinds


class _Heard(NamedTuple):
    """A message of a sensor."""

    stamp: float  # [s]
    arrival: float  # [s] of the listener's clock
    values: Values


class SensorListener:
    """The newest reading of each sensor, and when it came, by `clock` [s].

    Stamps may differ from that clock by `off` [s]; then, too, a reading counts only if its stamp is newer
    than the one before. None: the clock isn't that of the stamps. Raises RobotEnvError for an unknown sensor
    or topic.
    """

    def __init__(
        self, robot: Robot, names: Sequence[str], clock: Callable[[], float], off: float | None = None
    ) -> None:
        self._clock, self._off = clock, off
        self._arrived = threading.Condition()
        self._heard: dict[str, _Heard] = {}
        self._faults: dict[str, str] = {}
        self._periods: dict[str, float] = {}  # [s]
        self._resumed = 0.0  # [s] of the clock
        self._subscribers = {name: self._subscribed(robot, name) for name in names}

    def _subscribed(self, robot: Robot, name: str) -> rospy.Subscriber:
        topic, driver, rate = _source(robot, name)
        self._periods[name] = 1.0 / rate if rate else 0.0

        def receive(message: Any) -> None:
            with self._arrived:
                try:
                    self._take(name, driver, message)
                except ValueError as error:
                    self._faults[name] = f"the sensor '{name}': {error}"
                self._arrived.notify_all()

        return rospy.Subscriber(topic, driver.message, receive, queue_size=1, tcp_nodelay=True)

    def _take(self, name: str, driver: TopicSource, message: Any) -> None:
        stamp, now = message.header.stamp.to_sec(), self._clock()
        if self._off is not None and stamp:
            if abs(now - stamp) > self._off:
                raise ValueError(
                    f"stamps are {abs(now - stamp):.1f} s off the clock: the machines' clocks differ, "
                    "or messages are held up"
                )
            if name in self._heard and stamp <= self._heard[name].stamp:
                return
        assert driver.read is not None
        self._heard[name] = _Heard(stamp, now, driver.read(message))
        self._faults.pop(name, None)

    def missing(self) -> list[str]:
        """Returns the topics that nothing has come on."""
        with self._arrived:
            return [
                str(each.resolved_name) for name, each in self._subscribers.items() if name not in self._heard
            ]

    def fault(self) -> str:
        """Returns why the newest message of a sensor can't be read; empty if all can."""
        with self._arrived:
            return next(iter(self._faults.values()), "")

    def wait(self, timeout: float) -> bool:
        """Returns whether something has come of all, at the latest after so long [s of wall time]."""
        with self._arrived:
            return self._arrived.wait_for(lambda: len(self._heard) == len(self._subscribers), timeout)

    def trouble(self, late: float) -> str:
        """Returns which sensor is unreadable, or silent for `late` [s] and three periods since `resume`."""
        now = self._clock()
        with self._arrived:
            for name, heard in self._heard.items():
                most = max(late, LATE_PERIODS * self._periods[name])
                since = max(heard.arrival, self._resumed)
                if now - since > most and name not in self._faults:
                    return f"no message on {self._subscribers[name].resolved_name} for {most:g} s"
            return self.fault()

    def resume(self) -> None:
        """Tells that a world which stood still moves on from now."""
        self._resumed = self._clock()

    def read(self, begin: float) -> Sensors:
        """Returns the newest readings, whose times are counted from `begin` [s]."""
        with self._arrived:
            return Sensors(
                (name, Reading(self._heard[name].stamp - begin, self._heard[name].values))
                for name in self._subscribers
            )

    def forget(self) -> None:
        """Forgets all that has come."""
        with self._arrived:
            self._heard.clear()
            self._faults.clear()

    def close(self) -> None:
        """Unsubscribes."""
        for each in self._subscribers.values():
            each.unregister()


def _source(robot: Robot, name: str) -> tuple[str, TopicSource, float]:
    """Returns the topic of a sensor, how it is read, and the slower of its rate and the plugin's [Hz]."""
    if name == ODOMETRY and robot.odometry:
        topic = rospy.names.ns_join(f"/{robot.namespace.strip('/')}", robot.odometry)
        return topic, TopicSource(Odometry, read=_motion), 0.0
    libraries, kinds = sources()
    known = {
        each.name: (each.kind, next(iter(each.plugins), None), each.rate) for each in robot.links.sensors
    }
    for plugin in robot.links.plugins:
        if library_of(plugin.filename) in libraries:
            known[plugin.name] = ("", plugin, 0.0)
    plain = name.removeprefix(f"{robot.model}::")
    if plain not in known:
        near = did_you_mean(plain, known) or f"; there are: {', '.join(known) or 'none'}"
        raise RobotEnvError(f"the robot '{robot.model}' has no sensor '{plain}'{near}")
    kind, of_sensor, rate = known[plain]
    own = None if of_sensor is None else libraries.get(library_of(of_sensor.filename))
    driver, given = own or kinds.get(kind), robot.sensor_topics.get(plain)
    if driver is None or not (given or own):
        raise RobotEnvError(
            f"the topic of the sensor '{plain}' isn't known: name it in the robot's sensor_topics"
        )
    if own and of_sensor is not None:
        try:
            own_rate = value(of_sensor.element, own.rate[0], f"the sensor '{plain}'", own.rate[1])
        except DescriptionError as error:
            raise RobotEnvError(str(error)) from error
        rate = slower(own_rate, rate)
    if given:
        return given, driver, rate
    assert of_sensor is not None
    return _topic_of(robot, of_sensor, driver), driver, rate


def _topic_of(robot: Robot, plugin: Plugin, driver: TopicSource) -> str:
    def text(tag: str, default: str) -> str:
        return (plugin.element.findtext(tag) or "").strip() or default

    own = plugin.element.findtext("robotNamespace")
    given = f"/{robot.namespace.strip('/')}" if own is None else own.strip()
    namespace = given or (robot.model if driver.empty == MODEL else driver.empty)
    scope = text("cameraName", "")
    parts = [text(driver.tag, driver.topic)]
    for outer in (scope if driver.message is Image else "", namespace):
        if outer and not parts[0].startswith("/"):
            parts.insert(0, outer)
    return "/" + "/".join(filter(None, "/".join(parts).split("/")))
