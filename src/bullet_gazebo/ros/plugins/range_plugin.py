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
from bullet_gazebo.sensors.laser import Scan, nearest


class RangePlugin(SensorPlugin):
    """Publishes the smallest range, at most the largest that the sensor measures."""

    def __init__(self, context: PluginContext) -> None:
        own = context.rate()
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


LIBRARIES = {"libgazebo_ros_range.so": RangePlugin}
