"""libgazebo_ros_imu_sensor.so: a sensor of type imu, which feels gravity (docs/contract/sensors.md 3a).

`frameName`, which is required, and `topicName` (imu_data) are read; see `ImuSensor` for the rest. The slower
of the two rates counts.
"""

from sensor_msgs.msg import Imu as ImuMsg

from bullet_gazebo.ros.common.messages import to_imu
from bullet_gazebo.ros.plugins.plugin_loader import PluginContext
from bullet_gazebo.ros.plugins.sensor_topics import (
    MODEL,
    SensorPlugin,
    SensorTopic,
    namespace_of,
    topic_in,
)
from bullet_gazebo.sensors.imu import ImuSensor


class ImuSensorPlugin(SensorPlugin):
    """Publishes what an IMU measures, in its own axes."""

    def __init__(self, context: PluginContext) -> None:
        self._imu = imu = ImuSensor(context)
        self._frame = context.required("frameName").lstrip("/")
        name = topic_in(
            namespace_of(context, absent=MODEL, empty="/"), context.text("topicName", "imu_data")
        )
        SensorTopic(context, name, ImuMsg, imu.rate, self._measure, at_once=False)

    def _measure(self, now: int) -> ImuMsg | None:
        sample = self._imu.measure(now)
        return sample and to_imu(sample, now, self._frame, self._imu.deviation)


LIBRARIES = {"libgazebo_ros_imu_sensor.so": ImuSensorPlugin}
