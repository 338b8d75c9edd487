"""Plugins of IMUs (docs/contract/sensors.md 3). `ModelImu` and `ImuSensor` read the rest of their elements.

- libgazebo_ros_imu.so: the IMU of a model, which feels no gravity. `topicName` and `serviceName`
  (/default_imu) and `frameName` (the body's name) are read.
- libgazebo_ros_imu_sensor.so: a sensor of type imu, which feels gravity. `frameName`, which is required, and
  `topicName` (imu_data) are read. The slower of the two rates counts.
"""

from sensor_msgs.msg import Imu as ImuMsg
from std_srvs.srv import Empty, EmptyResponse

from bullet_gazebo.ros.common.messages import to_imu
from bullet_gazebo.ros.plugins.plugin_loader import PluginContext
from bullet_gazebo.ros.plugins.sensor_topics import (
    MODEL,
    SensorPlugin,
    SensorTopic,
    namespace_of,
    offer_shared,
    topic_in,
)
from bullet_gazebo.sensors.imu import ImuSensor, ModelImu


class ImuTopic(SensorPlugin):
    """Publishes orientation, angular velocity and acceleration.

    Args:
        context: the plugin's.
        imu: measures.
        name: of the topic.
        frame: of the header.
    """

    def __init__(self, context: PluginContext, imu: ModelImu, name: str, frame: str) -> None:
        self._imu, self._frame = imu, frame.lstrip("/")
        SensorTopic(context, name, ImuMsg, imu.rate, self._measure, at_once=False)

    def _measure(self, now: int) -> ImuMsg | None:
        sample = self._imu.measure(now)
        return sample and to_imu(sample, now, self._frame, self._imu.deviation)


class ImuPlugin(ImuTopic):
    """What the IMU of a link measures."""

    def __init__(self, context: PluginContext) -> None:
        imu, namespace = ModelImu(context), namespace_of(context, absent="", empty="/")
        service = topic_in(namespace, context.text("serviceName", "/default_imu"))
        # It does nothing, and another robot's may have the name.
        offer_shared(context, service, Empty, lambda request: EmptyResponse())
        topic = topic_in(namespace, context.text("topicName", "/default_imu"))
        super().__init__(
            context, imu, topic, context.text("frameName", context.text("bodyName", ""))
        )


class ImuSensorPlugin(ImuTopic):
    """What an IMU measures, in its own axes."""

    def __init__(self, context: PluginContext) -> None:
        imu, frame = ImuSensor(context), context.required("frameName")
        namespace = namespace_of(context, absent=MODEL, empty="/")
        topic = topic_in(namespace, context.text("topicName", "imu_data"))
        super().__init__(context, imu, topic, frame)


LIBRARIES = {
    "libgazebo_ros_imu.so": ImuPlugin,
    "libgazebo_ros_imu_sensor.so": ImuSensorPlugin,
}
