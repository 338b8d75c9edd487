"""libgazebo_ros_multicamera.so and ..._triggered_multicamera.so (docs/contract/sensors.md 4c, 11.6).

Several eyes that look at the same time.

Elements are those of the camera's plugin. Of the sensor's cameras, those with "left" and "right" in their
names have topics, below left/ and right/ of `cameraName`; `hackBaseline` is the right one's.
"""

from bullet_gazebo.physics.description import DescriptionError
from bullet_gazebo.ros.plugins.camera_plugin import Triggers
from bullet_gazebo.ros.plugins.camera_topics import CameraTopics, rate_of, scope_of
from bullet_gazebo.ros.plugins.plugin_loader import PluginContext
from bullet_gazebo.ros.plugins.sensor_topics import SensorTopics, sensor_of, topic_in
from bullet_gazebo.sensors.pinhole import PinholeCamera

SIDES = ("left", "right")


class MulticameraPlugin:
    """Publishes the pictures of all its cameras, of one time, while somebody looks at one of them."""

    is_triggered = False

    def __init__(self, context: PluginContext) -> None:
        self._context = context
        self._sensor = sensor = sensor_of(context, ("multicamera",))
        scope = scope_of(context)
        self._topics = SensorTopics(context, rate_of(context, sensor), self._on_clock)
        self._eyes: list[tuple[PinholeCamera, CameraTopics]] = []
        for element in sensor.element.findall("camera"):
            name = element.get("name", "")
            side = next((each for each in SIDES if each in name), None)
            if side is None:
                continue
            camera = PinholeCamera(element, sensor.pose, f"sensor '{sensor.name}', camera '{name}'")
            names = tuple(
                f"{side}/{context.text(tag, default)}"
                for tag, default in (
                    ("imageTopicName", "image_raw"), ("cameraInfoTopicName", "camera_info"),
                )
            )  # fmt: skip
            baseline = context.number("hackBaseline", 0.0) if side == SIDES[1] else 0.0
            self._eyes.append((camera, CameraTopics(
                context, camera, self._topics, scope, (names[0], names[1]), baseline, f"{side}/",
            )))  # fmt: skip
        if not self._eyes:
            raise DescriptionError("no <camera> has left or right in its name")
        self._triggers = None
        if self.is_triggered:
            topic = topic_in(scope, context.text("triggerTopicName", "image_trigger"))
            self._triggers = Triggers(context, topic, self._take)

    def shutdown(self) -> None:
        """The context closes its topics."""

    def _on_clock(self, now: int) -> None:
        if self._triggers is None:
            self._take(now)

    def _take(self, now: int) -> None:
        link = self._context.model.link_state(self._sensor.link)[0]
        for camera, topics in self._eyes:
            topics.send(
                camera.picture(self._context.sensing.visuals, link, topics.wants_colour), now
            )


class TriggeredMulticameraPlugin(MulticameraPlugin):
    """Publishes the pictures of all its cameras once for each trigger."""

    is_triggered = True


LIBRARIES = {
    "libgazebo_ros_multicamera.so": MulticameraPlugin,
    "libgazebo_ros_triggered_multicamera.so": TriggeredMulticameraPlugin,
}
