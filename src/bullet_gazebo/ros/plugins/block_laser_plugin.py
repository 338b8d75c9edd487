"""libgazebo_ros_block_laser.so: a laser's points as a PointCloud (docs/contract/sensors.md 2b).

`topicName` (/world), `frameName` (/world) and `gaussianNoise` (0) are read.
"""

import numpy as np
from geometry_msgs.msg import Point32
from sensor_msgs.msg import ChannelFloat32, PointCloud
from std_msgs.msg import Header

from bullet_gazebo.ros.common.messages import to_time
from bullet_gazebo.ros.plugins.plugin_loader import PluginContext
from bullet_gazebo.ros.plugins.sensor_topics import LaserTopic, SensorPlugin
from bullet_gazebo.sensors.laser import Scan


class BlockLaserPlugin(SensorPlugin):
    """Publishes all rays' points and intensities; a ray that meets nothing ends at the largest range."""

    def __init__(self, context: PluginContext) -> None:
        self._topic = LaserTopic(context, PointCloud, self._message, "/world", empty="/")
        self._deviation = context.deviation()

    def _message(self, scan: Scan, now: int, random: np.random.Generator) -> PointCloud:
        furthest = self._topic.laser.high
        ranges, intensities = np.minimum(scan.ranges, furthest).ravel(), scan.intensities.ravel()
        with np.errstate(invalid="ignore"):  # inf * 0
            points = ranges[:, None] * self._topic.laser.directions.reshape(-1, 3)
        if self._deviation:
            draws = random.normal(0.0, self._deviation, (len(ranges), 4))
            draws[~np.isfinite(ranges) | (ranges == furthest)] = 0.0
            points, intensities = points + draws[:, :3], intensities + draws[:, 3]
        return PointCloud(
            header=Header(stamp=to_time(now), frame_id=self._topic.frame),
            points=[Point32(*point) for point in points.tolist()],
            channels=[ChannelFloat32("", intensities.tolist())],
        )


LIBRARIES = {"libgazebo_ros_block_laser.so": BlockLaserPlugin}
