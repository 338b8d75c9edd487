"""libgazebo_ros_bumper.so: contacts of a link's collisions (docs/contract/sensors.md 5).

`bumperTopicName` (bumper_states) and `frameName` (world) are read. The frame is only in the header: all
values are in world axes.
"""

from gazebo_msgs.msg import ContactsState
from std_msgs.msg import Header

from bullet_gazebo.ros.common.messages import to_contact_state, to_time
from bullet_gazebo.ros.plugins.plugin_loader import PluginContext
from bullet_gazebo.ros.plugins.sensor_topics import (
    SensorPlugin,
    SensorTopic,
    frame_of,
    namespace_of,
    topic_in,
)
from bullet_gazebo.sensors.contact import ContactSensor


class BumperPlugin(SensorPlugin):
    """Publishes what the collisions of `<contact>` touched in the last step, also if that is nothing."""

    def __init__(self, context: PluginContext) -> None:
        self._sensor = sensor = ContactSensor(context)
        namespace = namespace_of(context, absent="", empty="/")
        self._frame = frame_of(namespace, context.text("frameName", "world"))
        topic = topic_in(namespace, context.text("bumperTopicName", "bumper_states"))
        SensorTopic(context, topic, ContactsState, sensor.rate, self._measure)

    def _measure(self, now: int) -> ContactsState:
        header = Header(stamp=to_time(now), frame_id=self._frame)
        return ContactsState(header, [to_contact_state(pair) for pair in self._sensor.measure(now)])


LIBRARIES = {"libgazebo_ros_bumper.so": BumperPlugin}
