"""libgazebo_ros_laser.so and libgazebo_ros_gpu_laser.so: LaserScans (docs/contract/sensors.md 2).

`topicName` (/world) and `frameName` (/world) are read; the sensor says the rest. A laser meets collisions,
a gpu laser visuals.
"""

import numpy as np
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Header

from bullet_gazebo.ros.common.messages import to_time
from bullet_gazebo.ros.plugins.plugin_loader import PluginContext
from bullet_gazebo.ros.plugins.sensor_topics import MODEL, LaserTopic, SensorPlugin
from bullet_gazebo.sensors.laser import Scan


class LaserPlugin(SensorPlugin):
    """Publishes the scans of a laser."""

    def __init__(self, context: PluginContext) -> None:
        self._topic = LaserTopic(context, LaserScan, self._message, "/world", empty=MODEL)

    def _message(self, scan: Scan, now: int, random: np.random.Generator) -> LaserScan:
        laser = self._topic.laser
        return LaserScan(
            header=Header(stamp=to_time(now), frame_id=self._topic.frame),
            angle_min=laser.horizontal.low,
            angle_max=laser.horizontal.high,
            angle_increment=laser.horizontal.increment,
            range_min=laser.low,
            range_max=laser.high,
            ranges=scan.ranges.astype(np.float32).ravel(),
            intensities=scan.intensities.astype(np.float32).ravel(),
        )


LIBRARIES = dict.fromkeys(("libgazebo_ros_laser.so", "libgazebo_ros_gpu_laser.so"), LaserPlugin)
