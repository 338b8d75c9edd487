"""libgazebo_ros_imu.so: the IMU of a model, which feels no gravity (docs/contract/sensors.md 3b).

`bodyName` is required. `topicName` and `serviceName` (/default_imu), `frameName` (the body's name),
`updateRate` (0: every step), `gaussianNoise` (0) and `rpyOffset` are read.
"""

from contextlib import suppress

import rospy
from sensor_msgs.msg import Imu as ImuMsg
from std_srvs.srv import Empty, EmptyResponse

from bullet_gazebo.physics.description import DescriptionError
from bullet_gazebo.physics.files.elements import numbers
from bullet_gazebo.physics.model import Model
from bullet_gazebo.physics.pose import from_rpy, multiply
from bullet_gazebo.ros.plugins.plugin_loader import PluginContext
from bullet_gazebo.ros.plugins.sensor_topics import (
    SensorPlugin,
    SensorTopic,
    namespace_of,
    to_imu,
    topic_in,
)
from bullet_gazebo.sensors.imu import Imu, motion_of, with_noise


class ImuPlugin(SensorPlugin):
    """Publishes orientation, angular velocity and acceleration of a link."""

    def __init__(self, context: PluginContext) -> None:
        self._context = context
        self._model, self._link = _link_of(context)
        self._frame = context.text("frameName", context.text("bodyName", "")).lstrip("/")
        self._deviation = context.deviation()
        rpy = context.text("rpyOffset", "0 0 0")
        self._turn = from_rpy(*numbers(rpy, "<rpyOffset>", 3))
        namespace = namespace_of(context, absent="", empty="/")
        service = topic_in(namespace, context.text("serviceName", "/default_imu"))
        with suppress(
            rospy.ServiceException
        ):  # it does nothing, and another robot's may have the name
            offered = rospy.Service(service, Empty, lambda request: EmptyResponse())
            context.closing(offered.shutdown)
        topic = topic_in(namespace, context.text("topicName", "/default_imu"))
        rate = context.number("updateRate", 0.0)
        self._imu = Imu(feels_gravity=False, rate=rate)
        SensorTopic(context, topic, ImuMsg, rate, self._measure, at_once=False)

    def _measure(self, now: int) -> ImuMsg | None:
        context = self._context
        motion = motion_of(self._model, self._link)
        gravity, moves = context.sim.world.gravity, context.sensing.schedule.moves
        sample = self._imu.measure(now, moves, motion, gravity)
        if sample is None:
            return None
        sample = sample._replace(orientation=multiply(self._turn, sample.orientation))
        random = context.sensing.noise(context.model, context.key, now)
        return to_imu(
            with_noise(sample, self._deviation, random), now, self._frame, self._deviation
        )


def _link_of(context: PluginContext) -> tuple[Model, str]:
    """Returns the link `bodyName`: of its own model, or else of the world."""
    name = context.text("bodyName", "")
    if not name:
        raise DescriptionError("<bodyName> is missing")
    own = context.among("bodyName", context.model.link_names)
    if own:
        return context.model, own
    found = context.sim.world.link(name)
    if found is None:
        raise DescriptionError(f"<bodyName>: there is no link '{name}'")
    return found


LIBRARIES = {"libgazebo_ros_imu.so": ImuPlugin}
