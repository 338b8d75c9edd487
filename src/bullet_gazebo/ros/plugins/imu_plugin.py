"""libgazebo_ros_imu.so: the IMU of a model, which feels no gravity (docs/contract/sensors.md 3b).

`topicName` and `serviceName` (/default_imu) and `frameName` (the body's name) are read; see `ModelImu` for
the rest.
"""

from contextlib import suppress

import rospy
from sensor_msgs.msg import Imu as ImuMsg
from std_srvs.srv import Empty, EmptyResponse

from bullet_gazebo.ros.common.messages import to_imu
from bullet_gazebo.ros.plugins.plugin_loader import PluginContext
from bullet_gazebo.ros.plugins.sensor_topics import (
    SensorPlugin,
    SensorTopic,
    namespace_of,
    topic_in,
)
from bullet_gazebo.sensors.imu import ModelImu


class ImuPlugin(SensorPlugin):
    """Publishes orientation, angular velocity and acceleration of a link."""

    def __init__(self, context: PluginContext) -> None:
        self._imu = imu = ModelImu(context)
        self._frame = context.text("frameName", context.text("bodyName", "")).lstrip("/")
        namespace = namespace_of(context, absent="", empty="/")
        service = topic_in(namespace, context.text("serviceName", "/default_imu"))
        with suppress(
            rospy.ServiceException
        ):  # it does nothing, and another robot's may have the name
            offered = rospy.Service(service, Empty, lambda request: EmptyResponse())
            context.closing(offered.shutdown)
        topic = topic_in(namespace, context.text("topicName", "/default_imu"))
        SensorTopic(context, topic, ImuMsg, imu.rate, self._measure, at_once=False)

    def _measure(self, now: int) -> ImuMsg | None:
        sample = self._imu.measure(now)
        return sample and to_imu(sample, now, self._frame, self._imu.deviation)


LIBRARIES = {"libgazebo_ros_imu.so": ImuPlugin}
