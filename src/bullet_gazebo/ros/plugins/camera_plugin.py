"""libgazebo_ros_camera.so and libgazebo_ros_triggered_camera.so (docs/contract/sensors.md 4a, 11.6).

`cameraName`, `imageTopicName` (image_raw), `cameraInfoTopicName` (camera_info), `frameName`, `updateRate`,
`hackBaseline`, `Cx`, `Cy`, `focalLength`, `distortionK1` ... `distortionT2` are read; by the second also
`triggerTopicName` (image_trigger), whose every message takes one picture.
"""

import rospy
from std_msgs.msg import Empty

from bullet_gazebo.ros.plugins.camera_topics import CameraTopics, rate_of, scope_of
from bullet_gazebo.ros.plugins.plugin_loader import PluginContext
from bullet_gazebo.ros.plugins.sensor_topics import SensorTopics, sensor_of, topic_in
from bullet_gazebo.sensors.pinhole import camera_of

KINDS = ("camera",)


class CameraPlugin:
    """Publishes pictures while somebody looks at them."""

    def __init__(self, context: PluginContext) -> None:
        self._context = context
        self._sensor = sensor = sensor_of(context, KINDS)
        self._camera = camera_of(sensor)
        self._scope = scope_of(context)
        self._topics = SensorTopics(context, rate_of(context, sensor), self._on_clock)
        names = (
            context.text("imageTopicName", "image_raw"),
            context.text("cameraInfoTopicName", "camera_info"),
        )
        self._outputs = CameraTopics(
            context, sensor, self._camera, self._topics, self._scope, names,
            context.number("hackBaseline", 0.0),
        )  # fmt: skip

    def shutdown(self) -> None:
        self._outputs.close()
        self._topics.close()

    def _on_clock(self, now: int) -> None:
        self._take(now)

    def _take(self, now: int) -> None:
        link = self._context.model.link_state(self._sensor.link)[0]
        scene = self._context.sensing.visuals
        self._outputs.send(self._camera.picture(scene, link, self._outputs.wants_colour), now)


class TriggeredCameraPlugin(CameraPlugin):
    """Publishes one picture for each trigger, at the next step."""

    def __init__(self, context: PluginContext) -> None:
        super().__init__(context)
        self._waiting = 0
        name = topic_in(self._scope, context.text("triggerTopicName", "image_trigger"))
        self._trigger = rospy.Subscriber(name, Empty, self._on_trigger, tcp_nodelay=True)
        context.on_update(self._update)

    def shutdown(self) -> None:
        self._trigger.unregister()
        super().shutdown()

    def _on_trigger(self, _: Empty) -> None:
        with self._context.sim.lock:
            self._waiting += 1

    def _on_clock(self, now: int) -> None:
        """Triggers take pictures, not the clock."""

    def _update(self, now: int) -> None:
        if self._waiting:
            self._waiting -= 1
            self._context.sensing.visuals.expire()
            self._take(now)


LIBRARIES = {
    "libgazebo_ros_camera.so": CameraPlugin,
    "libgazebo_ros_triggered_camera.so": TriggeredCameraPlugin,
}
