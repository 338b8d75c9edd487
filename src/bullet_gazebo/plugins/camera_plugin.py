"""libgazebo_ros_camera.so, ..._multicamera.so and both triggered (docs/contract/sensors.md 4a, 4c, 11.6)."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import ClassVar

from sensor_msgs.msg import Image
from std_msgs.msg import Empty

from bullet_gazebo.plugins.camera_topics import CameraTopics, offer_rate, read_image, scope_of, stream_of
from bullet_gazebo.plugins.plugin_loader import PluginContext
from bullet_gazebo.plugins.sensor_topics import (
    MODEL,
    ContextPlugin,
    SensorTopics,
    TopicSource,
    subscribe,
    topic_in,
)
from robot_sim.physics.description import DescriptionError, Sensor
from robot_sim.sensors.camera_sensors import CameraSensor, camera_of, rate_of
from robot_sim.sensors.pinhole import CameraView, PinholeCamera
from robot_sim.sensors.sensing import sensor_of

MULTICAMERA = "multicamera"
SIDES = ("left/", "right/")
MOST_WAITING = 20  # triggers


class CameraPlugin(ContextPlugin):
    """Publishes the pictures of its cameras, of one time, while somebody looks at one of them."""

    source: ClassVar = TopicSource(
        Image, "image_raw", MODEL, tag="imageTopicName", rate=("updateRate", 0.0), read=read_image
    )
    measurement: ClassVar = CameraSensor
    kind = "camera"  # of sensor
    non_persistent = ("_has_subscribers", "_eyes")
    latch = False  # a new subscriber has a picture taken

    def __init__(self, context: PluginContext) -> None:
        self._context = context
        sensor = sensor_of(context, (self.kind,))
        topics = SensorTopics(context, rate_of(context, sensor), self._on_clock)
        self._has_subscribers = topics.has_subscribers
        self._scope = scope = scope_of(context)
        offer_rate(context, topics, scope)
        baseline = context.number("hackBaseline", 0.0)
        names = (
            context.text(self.source.tag, self.source.topic),
            context.text("cameraInfoTopicName", "camera_info"),
        )
        self._eyes = [
            CameraTopics(
                context, camera, topics, scope, (side + names[0], side + names[1]),
                0.0 if side == SIDES[0] else baseline, side, latch=self.latch,
            )
            for side, camera in _cameras(sensor, context.sensing.camera_scale)
        ]  # fmt: skip
        self._stream = stream_of(context)

    def _on_clock(self, now: int) -> None:
        self._take(now)

    def _take(self, now: int) -> None:
        self._stream.take([eye.shot(now) for eye in self._eyes], partial(self._send, now))

    def _send(self, now: int, views: Sequence[CameraView]) -> None:
        for eye, view in zip(self._eyes, views, strict=True):
            eye.send(view, now)


class MulticameraPlugin(CameraPlugin):
    """As the camera, for several."""

    source = replace(CameraPlugin.source, read=None)
    kind = MULTICAMERA


class TriggeredCameraPlugin(CameraPlugin):
    """Publishes pictures once for each trigger, at the next step."""

    source = replace(CameraPlugin.source, read=None)
    latch = True  # the last picture is all there is

    def __init__(self, context: PluginContext) -> None:
        super().__init__(context)
        self._waiting = 0
        topic = topic_in(self._scope, context.text("triggerTopicName", "image_trigger"))
        self._clock = context.clock(0.0, self._update, lambda: self._waiting > 0, at_once=False)
        subscribe(context, topic, Empty, self._on_trigger, MOST_WAITING)

    def _on_clock(self, now: int) -> None:
        """Triggers take pictures, not the clock."""

    def _on_trigger(self, _: Empty) -> None:
        with self._context.sim.lock:
            self._waiting = min(self._waiting + 1, MOST_WAITING)
        self._clock.look()

    def _update(self, now: int) -> None:
        if self._waiting and not self._stream.is_behind:
            self._waiting -= 1
            if self._has_subscribers():
                self._take(now)
        if not self._waiting:
            self._clock.look()


class TriggeredMulticameraPlugin(TriggeredCameraPlugin):
    """As the triggered camera, for several."""

    kind = MULTICAMERA


def _cameras(sensor: Sensor, scale: float) -> Iterator[tuple[str, PinholeCamera]]:
    """Yields each camera that has topics, with the prefix of its topics."""
    if sensor.kind != MULTICAMERA:
        yield "", camera_of(sensor, scale)
        return
    names = [(element, element.get("name", "")) for element in sensor.element.findall("camera")]
    sides = [(side, *each) for each in names for side in SIDES if side[:-1] in each[1]]
    if not sides:
        raise DescriptionError("no <camera> has left or right in its name")
    for side, element, name in sides:
        where = f"sensor '{sensor.name}', camera '{name}'"
        yield side, PinholeCamera(element, sensor.pose, where, sensor.link, scale)


LIBRARIES = {
    "libgazebo_ros_camera.so": CameraPlugin,
    "libgazebo_ros_multicamera.so": MulticameraPlugin,
    "libgazebo_ros_triggered_camera.so": TriggeredCameraPlugin,
    "libgazebo_ros_triggered_multicamera.so": TriggeredMulticameraPlugin,
}
