"""libgazebo_ros_camera.so and libgazebo_ros_triggered_camera.so (docs/contract/sensors.md 4a, 11.6).

`cameraName`, `imageTopicName` (image_raw), `cameraInfoTopicName` (camera_info), `frameName`, `updateRate`,
`hackBaseline`, `Cx`, `Cy`, `focalLength`, `distortionK1` ... `distortionT2` are read; by the second also
`triggerTopicName` (image_trigger), whose every message takes one picture.
"""

from collections.abc import Callable

import rospy
from std_msgs.msg import Empty

from bullet_gazebo.ros.plugins.camera_topics import CameraTopics, rate_of, scope_of
from bullet_gazebo.ros.plugins.plugin_loader import PluginContext
from bullet_gazebo.ros.plugins.sensor_topics import SensorTopics, sensor_of, topic_in
from bullet_gazebo.sensors.pinhole import camera_of

KINDS = ("camera",)


class Triggers:
    """Takes one picture for each message of a topic, at the next step.

    Args:
        context: the plugin's.
        topic: its full name.
        take: takes a picture at a time [ns].
    """

    def __init__(self, context: PluginContext, topic: str, take: Callable[[int], None]) -> None:
        self._context = context
        self._take = take
        self._waiting = 0
        subscriber = rospy.Subscriber(topic, Empty, self._on_message, tcp_nodelay=True)
        context.closing(subscriber.unregister)
        context.on_update(self._update)

    def _on_message(self, _: Empty) -> None:
        with self._context.sim.lock:
            self._waiting += 1

    def _update(self, now: int) -> None:
        if self._waiting:
            self._waiting -= 1
            self._context.sensing.visuals.expire()
            self._take(now)


class CameraPlugin:
    """Publishes pictures while somebody looks at them."""

    is_triggered = False

    def __init__(self, context: PluginContext) -> None:
        self._context = context
        self._sensor = sensor = sensor_of(context, KINDS)
        self._camera = camera_of(sensor)
        scope = scope_of(context)
        self._topics = SensorTopics(context, rate_of(context, sensor), self._on_clock)
        names = (
            context.text("imageTopicName", "image_raw"),
            context.text("cameraInfoTopicName", "camera_info"),
        )
        baseline = context.number("hackBaseline", 0.0)
        self._outputs = CameraTopics(context, self._camera, self._topics, scope, names, baseline)
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
        scene = self._context.sensing.visuals
        self._outputs.send(self._camera.picture(scene, link, self._outputs.wants_colour), now)


class TriggeredCameraPlugin(CameraPlugin):
    """Publishes one picture for each trigger."""

    is_triggered = True


LIBRARIES = {
    "libgazebo_ros_camera.so": CameraPlugin,
    "libgazebo_ros_triggered_camera.so": TriggeredCameraPlugin,
}
