"""librealsense_gazebo_plugin.so: the cameras of a RealSense (docs/contract/sensors.md 12.2)."""

from collections.abc import Sequence
from functools import partial

import numpy as np
from sensor_msgs.msg import CameraInfo, Image, PointCloud2
from std_msgs.msg import Header

from bullet_gazebo.common.messages import to_time
from bullet_gazebo.plugins.camera_topics import QUEUE, CameraTopics, camera_info, show_camera, stream_of
from bullet_gazebo.plugins.depth_camera_plugin import to_cloud, to_depth_image
from bullet_gazebo.plugins.plugin_loader import PluginContext
from bullet_gazebo.plugins.sensor_topics import ContextPlugin, SensorTopics, frame_of, topic_in
from robot_sim.physics.description import DescriptionError, Sensor
from robot_sim.physics.files.elements import truth
from robot_sim.sensors.camera_sensors import camera_of, shot_of
from robot_sim.sensors.pinhole import CameraView, PinholeCamera, Shot
from robot_sim.state_dict import Shared

DEPTH = "depth"
EYES = {  # by sensor: what its elements begin with, and its topic
    "color": ("color", "color"),
    DEPTH: (DEPTH, DEPTH),
    "ired1": ("infrared1", "infrared"),
    "ired2": ("infrared2", "infrared2"),
}


class RealsensePlugin(ContextPlugin):
    """Publishes the pictures of those cameras that the model has, while somebody looks at them."""

    def __init__(self, context: PluginContext) -> None:
        prefix = context.text("prefix", "")
        sensors = {sensor.name: sensor for sensor in context.model.description.sensors}
        eyes = [name for name in EYES if prefix + name in sensors]
        if not eyes:
            raise DescriptionError(f"<prefix>: the model has no sensor '{prefix}{DEPTH}' or the like")
        self._eyes = [
            (_Depths if name == DEPTH else _Eye)(context, name, sensors[prefix + name]) for name in eyes
        ]


class _Eye(Shared):
    """A camera of its own rate."""

    def __init__(self, context: PluginContext, name: str, sensor: Sensor) -> None:
        self.context = context
        self.camera = camera_of(sensor, context.sensing.camera_scale)
        self.element, topic = EYES[name]
        rate = context.rate(f"{self.element.rstrip('12')}UpdateRate", sensor.rate)
        self.topics = SensorTopics(context, rate, self.take)
        self.scope = topic_in("", context.plugin.name)
        self.topic = context.text(f"{self.element}TopicName", topic)
        self.frame = context.text(f"{self.element}OpticalframeName", f"{name}_optical_frame")
        self.info_topic = f"{self.topic.rpartition('/')[0]}/camera_info".lstrip("/")
        self.open()
        self._stream = stream_of(context)

    def open(self) -> None:
        """Advertises its topics."""
        names = self.topic, self.info_topic
        self._pictures = CameraTopics(
            self.context, self.camera, self.topics, self.scope, names, 0.0, f"{self.element}/",
            self.frame,
        )  # fmt: skip
        self._pictures.info = _centred(self.context, self.camera)

    def take(self, now: int) -> None:
        """Publishes the subscribed parts of a picture at a time [ns], once it is rendered."""
        self._stream.take([self.shot(now)], partial(self.send, now))

    def shot(self, now: int) -> Shot:
        """Returns the parts with subscribers."""
        return self._pictures.shot(now)

    def send(self, now: int, views: Sequence[CameraView]) -> None:
        """Publishes it."""
        self._pictures.send(views[0], now)


class _Depths(_Eye):
    """Depths in mm, 0 outside the range, and organised clouds."""

    def open(self) -> None:
        context, topics = self.context, self.topics
        pixels, depth = self.camera.width * self.camera.height, topic_in(self.scope, self.topic)
        self._depth = topics.advertise(depth, Image, QUEUE, content=2 * pixels)
        show_camera(context, depth, Image, self.camera)
        info = topic_in(self.scope, self.info_topic)
        self._info_topic = topics.advertise(info, CameraInfo, QUEUE)
        self._info = _centred(context, self.camera)
        self._frame = frame_of(self.scope, self.frame)
        self._cloud = None
        if truth(context.text("pointCloud", "false")):
            cloud = topic_in(self.scope, context.text("pointCloudTopicName", "depth/points"))
            self._cloud = topics.advertise(cloud, PointCloud2, content=32 * pixels)
            show_camera(context, cloud, PointCloud2, self.camera)
        self._low = context.number("rangeMinDepth", 0.2)
        self._high = context.number("rangeMaxDepth", 10.0)
        self._near = context.number("pointCloudCutoff", 0.5)
        self._far = context.number("pointCloudCutoffMax", 5.0)

    def shot(self, now: int) -> Shot:
        is_cloud = self._cloud is not None and self._cloud.has_subscribers
        depths = is_cloud or self._depth.has_subscribers
        return shot_of(self.context, self.camera, now, colours=is_cloud, depths=depths)

    def send(self, now: int, views: Sequence[CameraView]) -> None:
        [seen] = views
        header = Header(stamp=to_time(now), frame_id=self._frame)
        if seen.depths.size and self._depth.has_subscribers:
            depths = _within(seen.depths, self._low, self._high)
            self._depth.publish(to_depth_image(depths, True, header))
        if self._info_topic.has_subscribers:
            self._info.header = header
            self._info_topic.publish(self._info)
        if self._cloud is not None and seen.colours.size and self._cloud.has_subscribers:
            depths = _within(seen.depths, self._near, self._far)
            self._cloud.publish(to_cloud(depths, seen.colours, self.camera, True, header))


def _within(depths: np.ndarray, low: float, high: float) -> np.ndarray:
    return np.where((depths >= low) & (depths <= high), depths, np.nan)


def _centred(context: PluginContext, camera: PinholeCamera) -> CameraInfo:
    """Returns the calibration with half of the picture's size as its centre."""
    info = camera_info(context, camera)
    for matrix, row in ((info.K, 3), (info.P, 4)):
        matrix[2], matrix[row + 2] = camera.width / 2.0, camera.height / 2.0
    return info


LIBRARIES = {"librealsense_gazebo_plugin.so": RealsensePlugin}
