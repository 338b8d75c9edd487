"""libgazebo_ros_depth_camera.so and libgazebo_ros_openni_kinect.so (docs/contract/sensors.md 4b)."""

from collections.abc import Sequence
from functools import partial
from typing import ClassVar

import numpy as np
from sensor_msgs.msg import CameraInfo, Image, PointCloud2, PointField
from std_msgs.msg import Header

from bullet_gazebo.plugins.camera_topics import (
    QUEUE,
    CameraTopics,
    offer_rate,
    read_depth,
    scope_of,
    show_camera,
    stream_of,
)
from bullet_gazebo.plugins.plugin_loader import PluginContext
from bullet_gazebo.plugins.sensor_topics import MODEL, ContextPlugin, SensorTopics, TopicSource, topic_in
from robot_sim.physics.files.elements import truth
from robot_sim.sensors.camera_sensors import KINECT, DepthSensor
from robot_sim.sensors.pinhole import CameraView, PinholeCamera

POINT_STEP = 32
FIELDS = {"x": 0, "y": 4, "z": 8, "rgb": 16}
POINT = np.dtype(
    {
        "names": [*FIELDS], "formats": ["<f4", "<f4", "<f4", "<u4"], "offsets": [*FIELDS.values()],
        "itemsize": POINT_STEP,
    }
)  # fmt: skip


class DepthCameraPlugin(ContextPlugin):
    """Publishes depths along the optical axis [m], and clouds in optical axes: x right, y down, z ahead."""

    source: ClassVar = TopicSource(
        Image, "depth/image_raw", MODEL, tag="depthImageTopicName", rate=("updateRate", 0.0),
        read=read_depth,
    )  # fmt: skip
    measurement: ClassVar = DepthSensor
    non_persistent = ("_sensor", "_depth_info")
    is_organised = False  # whether a cloud has the picture's rows

    def __init__(self, context: PluginContext) -> None:
        self._sensor = sensor = DepthSensor(context)
        camera = sensor.camera
        scope = scope_of(context)
        topics = SensorTopics(context, sensor.rate, self._measure)
        offer_rate(context, topics, scope)
        names = (
            context.text("imageTopicName", "ir/image_raw"),
            context.text("cameraInfoTopicName", "ir/camera_info"),
        )
        baseline = context.number("hackBaseline", 0.0)
        self._pictures = CameraTopics(context, camera, topics, scope, names, baseline)

        def named(tag: str, default: str) -> str:
            return topic_in(scope, context.text(tag, default))

        pixels = camera.width * camera.height
        depth = named(self.source.tag, self.source.topic)
        cloud = named("pointCloudTopicName", "points")
        self._depth = topics.advertise(depth, Image, content=4 * pixels)
        self._cloud = topics.advertise(cloud, PointCloud2, content=POINT_STEP * pixels)
        for name, kind in ((depth, Image), (cloud, PointCloud2)):
            show_camera(context, name, kind, camera)
        info = named("depthImageCameraInfoTopicName", "depth/camera_info")
        self._depth_info = topics.advertise(info, CameraInfo, QUEUE, wakes=False)
        self._in_millimetres = truth(context.text("useDepth16UC1Format", "false"))
        self._stream = stream_of(context)

    def _measure(self, now: int) -> None:
        is_cloud = self._cloud.has_subscribers
        shot = self._pictures.shot(now, colours=is_cloud, depths=is_cloud or self._depth.has_subscribers)
        self._stream.take([shot], partial(self._send, now))

    def _send(self, now: int, views: Sequence[CameraView]) -> None:
        [picture] = views
        self._pictures.send(picture, now)
        header = self._pictures.header(now)
        depths = self._sensor.depths(picture)
        if depths.size and self._depth.has_subscribers:
            self._depth.publish(to_depth_image(depths, self._in_millimetres, header))
        if self._depth_info.has_subscribers:
            info = self._pictures.info
            info.header = header
            self._depth_info.publish(info)
        if picture.colours.size and self._cloud.has_subscribers:
            self._cloud.publish(
                to_cloud(depths, picture.colours, self._sensor.camera, self.is_organised, header)
            )


class KinectPlugin(DepthCameraPlugin):
    """As the depth camera, with organised clouds that end at `pointCloudCutoffMax`."""

    is_organised = True


def to_depth_image(depths: np.ndarray, in_millimetres: bool, header: Header) -> Image:
    """Returns the message of depths (height, width) [m], NaN for no reading."""
    height, width = depths.shape
    if in_millimetres:
        whole = np.nan_to_num(np.rint(1000.0 * depths), nan=0.0)
        data = np.where(whole <= np.iinfo(np.uint16).max, whole, 0.0).astype("<u2")
        return Image(header, height, width, "16UC1", 0, 2 * width, data.tobytes())
    data = depths.astype("<f4")
    return Image(header, height, width, "32FC1", 0, 4 * width, data.tobytes())


def to_cloud(
    depths: np.ndarray, colours: np.ndarray, camera: PinholeCamera, organised: bool, header: Header
) -> PointCloud2:
    """Returns the points of depths (height, width) [m] and colours (height, width, 3)."""
    height, width = depths.shape
    points = np.zeros((height, width), POINT)
    points["x"], points["y"], points["z"] = depths * camera.across, depths * camera.down, depths
    red, green, blue = np.moveaxis(colours.astype(np.uint32), 2, 0)
    points["rgb"] = red << 16 | green << 8 | blue
    if not organised:
        height, width = 1, height * width
    return PointCloud2(
        header=header, height=height, width=width,
        fields=[PointField(name, at, PointField.FLOAT32, 1) for name, at in FIELDS.items()],
        point_step=POINT_STEP, row_step=POINT_STEP * width, data=points.tobytes(),
        is_dense=not bool(np.isnan(depths).any()),
    )  # fmt: skip


LIBRARIES = {"libgazebo_ros_depth_camera.so": DepthCameraPlugin, KINECT: KinectPlugin}
