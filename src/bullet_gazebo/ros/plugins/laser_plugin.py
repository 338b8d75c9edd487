"""libgazebo_ros_laser.so and libgazebo_ros_gpu_laser.so: LaserScans (docs/contract/sensors.md 2).

`topicName` (/world) and `frameName` (/world) are read; the sensor says the rest. A laser meets collisions,
a gpu laser visuals.
"""

import numpy as np
import rospy
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Header

from bullet_gazebo.ros.common.messages import to_time
from bullet_gazebo.ros.plugins.plugin_loader import PluginContext
from bullet_gazebo.ros.plugins.sensor_topics import (
    MODEL,
    SensorTopic,
    frame_of,
    namespace_of,
    sensor_of,
    topic_in,
)
from bullet_gazebo.sensors.laser import KINDS, Laser
from bullet_gazebo.sensors.sensing import sensor_pose


class LaserPlugin:
    """Publishes the scans of a laser."""

    def __init__(self, context: PluginContext) -> None:
        self._context = context
        self._sensor = sensor_of(context, KINDS)
        self._laser = Laser(self._sensor)
        sensing = context.sensing
        self._scene = sensing.visuals if self._laser.sees_visuals else sensing.collisions
        self._bias = self._laser.draw_bias(sensing.bias(context.model, self._sensor))
        namespace = namespace_of(context, absent="", empty=MODEL)
        self._frame = frame_of(namespace, context.text("frameName", "/world"))
        name = context.plugin.element.findtext("topicName", "/world").strip()
        self._topic = None
        if name:
            self._topic = SensorTopic(
                context, topic_in(namespace, name), LaserScan, self._sensor.rate, self._measure
            )
        else:
            rospy.logwarn("Sensor '%s': its <topicName> is empty", self._sensor.name)

    def shutdown(self) -> None:
        if self._topic is not None:
            self._topic.close()

    def _measure(self, now: int) -> LaserScan:
        laser, model = self._laser, self._context.model
        random = self._context.sensing.noise(model, self._sensor, now)
        scan = laser.measure(self._scene, sensor_pose(model, self._sensor), self._bias, random)
        return LaserScan(
            header=Header(stamp=to_time(now), frame_id=self._frame),
            angle_min=laser.horizontal.low,
            angle_max=laser.horizontal.high,
            angle_increment=laser.horizontal.increment,
            range_min=laser.low,
            range_max=laser.high,
            ranges=scan.ranges.astype(np.float32).ravel(),
            intensities=scan.intensities.astype(np.float32).ravel(),
        )


LIBRARIES = dict.fromkeys(("libgazebo_ros_laser.so", "libgazebo_ros_gpu_laser.so"), LaserPlugin)
