"""The plugin of a sensor that the software doesn't have."""

import numpy as np
from sensor_msgs.msg import Temperature
from std_msgs.msg import Header

from bullet_gazebo.common.messages import to_time
from bullet_gazebo.plugins.sensor_topics import SensorPlugin, TopicSource
from robot_sim.sensors.thermometer import Thermometer


def read(message: Temperature) -> dict[str, np.ndarray]:
    """Returns what a message says."""
    return {"temperature": np.array([message.temperature])}


class ThermometerPlugin(SensorPlugin):
    """Publishes temperatures."""

    source = TopicSource(Temperature, "temperature", read=read)
    measurement = Thermometer

    def measure(self, now: int) -> Temperature:
        """Returns the message of a measurement at a time [ns]."""
        header = Header(stamp=to_time(now), frame_id=self.frame)
        return Temperature(header, float(self.sensor.values(now)["temperature"][0]), 0.0)


LIBRARIES = {"libthermometer.so": ThermometerPlugin}
