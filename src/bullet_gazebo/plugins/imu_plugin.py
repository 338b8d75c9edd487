"""Plugins of IMUs, with and without gravity (docs/contract/sensors.md 3)."""

import numpy as np
from sensor_msgs.msg import Imu as ImuMsg
from std_srvs.srv import Empty, EmptyResponse

from bullet_gazebo.common.messages import to_imu
from bullet_gazebo.plugins.plugin_loader import PluginContext
from bullet_gazebo.plugins.sensor_topics import MODEL, SensorPlugin, TopicSource, offer_shared, topic_in
from robot_sim.sensors.imu import ImuSensor, ModelImu


def read_imu(message: ImuMsg) -> dict[str, np.ndarray]:
    """Returns what an IMU's message says; a number that isn't finite is a ValueError."""
    turn, spin, push = message.orientation, message.angular_velocity, message.linear_acceleration
    measured = {
        "orientation": np.array([turn.x, turn.y, turn.z, turn.w]),
        "angular_velocity": np.array([spin.x, spin.y, spin.z]),
        "linear_acceleration": np.array([push.x, push.y, push.z]),
    }
    for name, numbers in measured.items():
        if not np.isfinite(numbers).all():
            raise ValueError(f"{name} is {numbers.tolist()}")
    return measured


class ImuPlugin(SensorPlugin):
    """Publishes what the IMU of a link measures."""

    source = TopicSource(ImuMsg, "/default_imu", rate=("updateRate", 0.0), read=read_imu)
    measurement = ModelImu
    at_once = False

    def __init__(self, context: PluginContext) -> None:
        super().__init__(context)
        self.frame = self.frame_id()
        self.offer_services()

    def frame_id(self) -> str:
        """Returns the frame of the header: neither plugin gives it a prefix."""
        return self.context.text("frameName", self.context.text("bodyName", "")).lstrip("/")

    def offer_services(self) -> None:
        """Offers a service that does nothing; another robot's may have the name."""
        service = topic_in(self.namespace, self.context.text("serviceName", "/default_imu"))
        offer_shared(self.context, service, Empty, lambda request: EmptyResponse())

    def measure(self, now: int) -> ImuMsg | None:
        sample = self.sensor.measure(now)
        return sample and to_imu(sample, now, self.frame, self.sensor.deviation)


class ImuSensorPlugin(ImuPlugin):
    """Publishes what an IMU measures, in its own axes."""

    source = TopicSource(ImuMsg, "imu_data", absent=MODEL, rate=("updateRateHZ", 1.0), read=read_imu)
    measurement = ImuSensor

    def frame_id(self) -> str:
        """Returns the frame of the header, which has to be named."""
        return self.context.required("frameName").lstrip("/")

    def offer_services(self) -> None:
        """It has none."""


LIBRARIES = {"libgazebo_ros_imu.so": ImuPlugin, "libgazebo_ros_imu_sensor.so": ImuSensorPlugin}
