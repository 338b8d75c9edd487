"""libgazebo_ros_range.so: the nearest of a laser's rays (docs/contract/sensors.md 6f).

`topicName` (/range), `frameName` (/world), `gaussianNoise` (0), `updateRate` (0), `radiation` (ultrasound,
else infrared) and `fov` (0.05 rad) are read.
"""

import numpy as np
from sensor_msgs.msg import Range
from std_msgs.msg import Header

from bullet_gazebo.ros.common.messages import to_time
from bullet_gazebo.ros.plugins.plugin_loader import PluginContext
from bullet_gazebo.ros.plugins.sensor_topics import LaserTopic, SensorPlugin
from bullet_gazebo.sensors.laser import Laser, Scan


class RangePlugin(SensorPlugin):
    """Publishes the smallest range, at most the largest that the sensor measures."""

    def __init__(self, context: PluginContext) -> None:
        own = context.number("updateRate", 0.0)
        self._topic = LaserTopic(context, Range, self._message, "/range", empty="/", own_rate=own)
        self._deviation = context.deviation()
        self._is_sound = context.text("radiation", "infrared") == "ultrasound"
        self._field_of_view = context.number("fov", 0.05)

    def _message(self, scan: Scan, now: int, random: np.random.Generator) -> Range:
        laser = self._topic.laser
        return Range(
            header=Header(stamp=to_time(now), frame_id=self._topic.frame),
            radiation_type=Range.ULTRASOUND if self._is_sound else Range.INFRARED,
            field_of_view=self._field_of_view,
            min_range=laser.low,
            max_range=laser.high,
            range=nearest(scan, laser, self._deviation, random),
        )


def nearest(scan: Scan, laser: Laser, deviation: float, random: np.random.Generator) -> float:
    """Returns the smallest range of a scan [m], with noise if it is below the largest."""
    found = float(np.clip(scan.ranges.min(), laser.low, laser.high))
    if found < laser.high and deviation:
        found += float(random.normal(0.0, deviation))
    return min(found, laser.high)


LIBRARIES = {"libgazebo_ros_range.so": RangePlugin}
