"""libgazebo_ros_velodyne_laser.so and ..._gpu_laser.so: clouds of a laser (docs/contract/sensors.md 6a).

`topicName` (/points), `frameName` (/world), `min_range` (0), `max_range` (none), `min_intensity` (none) and
`gaussianNoise` (0) are read. The layout is that of upstream since 1.0.10: 22 bytes a point.
"""

import math

import numpy as np
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import Header

from bullet_gazebo.ros.common.messages import to_time
from bullet_gazebo.ros.plugins.plugin_loader import PluginContext
from bullet_gazebo.ros.plugins.sensor_topics import LaserTopic, SensorPlugin
from bullet_gazebo.sensors.laser import Scan

POINT = np.dtype(
    [
        ("x", "<f4"),
        ("y", "<f4"),
        ("z", "<f4"),
        ("intensity", "<f4"),
        ("ring", "<u2"),
        ("time", "<f4"),
    ]
)
FIELDS = [
    PointField("x", 0, PointField.FLOAT32, 1),
    PointField("y", 4, PointField.FLOAT32, 1),
    PointField("z", 8, PointField.FLOAT32, 1),
    PointField("intensity", 12, PointField.FLOAT32, 1),
    PointField("ring", 16, PointField.UINT16, 1),
    PointField("time", 18, PointField.FLOAT32, 1),
]


class VelodynePlugin(SensorPlugin):
    """Publishes the points that lie within the range, column by column, the lowest ring first."""

    def __init__(self, context: PluginContext) -> None:
        self._topic = topic = LaserTopic(context, PointCloud2, self._message, "/points", empty="")
        laser = topic.laser
        self._low = max(context.number("min_range", 0.0), laser.low)
        self._high = min(context.number("max_range", math.inf), laser.high)
        self._least = context.number("min_intensity", -math.inf)
        self._deviation = context.deviation()
        self._rings = np.broadcast_to(
            np.arange(laser.vertical.readings),
            (laser.horizontal.readings, laser.vertical.readings),
        )

    def _message(self, scan: Scan, now: int, random: np.random.Generator) -> PointCloud2:
        ranges, intensities = scan.ranges.T, scan.intensities.T
        seen = self._within(ranges) & (intensities >= self._least)
        if self._deviation:
            ranges = ranges + random.normal(0.0, self._deviation, ranges.shape)
            seen &= self._within(ranges)
        points = np.zeros(int(seen.sum()), POINT)
        directions = self._topic.laser.directions.transpose(1, 0, 2)
        places = ranges[seen][:, None] * directions[seen]
        points["x"], points["y"], points["z"] = places.T
        points["intensity"], points["ring"] = intensities[seen], self._rings[seen]
        return PointCloud2(
            header=Header(stamp=to_time(now), frame_id=self._topic.frame),
            height=1,
            width=len(points),
            fields=FIELDS,
            point_step=POINT.itemsize,
            row_step=points.nbytes,
            data=points.tobytes(),
            is_dense=True,
        )

    def _within(self, ranges: np.ndarray) -> np.ndarray:
        return (self._low < ranges) & (ranges < self._high)


NAMES = ("libgazebo_ros_velodyne_laser.so", "libgazebo_ros_velodyne_gpu_laser.so")
LIBRARIES = dict.fromkeys(NAMES, VelodynePlugin)
