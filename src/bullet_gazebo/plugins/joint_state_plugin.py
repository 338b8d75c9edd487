"""libgazebo_ros_joint_state_publisher.so: joint states of a model (docs/contract/gazebo_launch.md 5.2)."""

import re

import rospy
from sensor_msgs.msg import JointState
from std_msgs.msg import Header

from bullet_gazebo.common.messages import to_time
from bullet_gazebo.plugins.plugin_loader import PluginContext
from bullet_gazebo.plugins.sensor_topics import ContextPlugin, advertised
from robot_sim.constants import NANOSECONDS

QUEUE = 1000
RATE = "100.0"  # [Hz]


class JointStatePlugin(ContextPlugin):
    """Publishes position [rad, m] and velocity of the named joints, in the order of the list."""

    def __init__(self, context: PluginContext) -> None:
        self._model = context.model
        self._names = _joints(context)
        self._period = _period(context)
        self._last = context.sim.now
        namespace = rospy.names.ns_join(rospy.get_namespace(), context.namespace)
        topic = rospy.names.ns_join(namespace, "joint_states")
        self._topic = advertised(context, topic, JointState, QUEUE)
        context.on_update(self._update)

    def _update(self, now: int) -> None:
        if now < self._last:  # time was reset: the next state is due now
            self._last = now - self._period
        if now - self._last < self._period:
            return
        # The next one is due a period after this one was due, however late this one is.
        self._last = max(self._last + self._period, now - self._period)
        if not self._topic.has_subscribers:
            return
        states = [self._model.joint_state(name) for name in self._names]
        message = JointState(
            header=Header(stamp=to_time(now)),
            name=self._names,
            position=[position for position, _ in states],
            velocity=[velocity for _, velocity in states],
        )
        self._topic.publish(message)


def _joints(context: PluginContext) -> list[str]:
    """Returns the listed joints that the model has, after a warning about the others."""
    listed = [name for name in re.split(r"[\s,]+", context.text("jointName", "")) if name]
    unknown = [name for name in listed if name not in context.model.joint_names]
    if unknown or not listed:
        rospy.logwarn(
            "%s: model '%s' has no joint %s",
            context.plugin.filename, context.model.name, unknown or "listed",
        )  # fmt: skip
    return [name for name in listed if name not in unknown]


def _period(context: PluginContext) -> int:
    """Returns the time between two messages [ns]; 0 for one at every step."""
    text = context.text("updateRate", RATE)
    try:
        rate = float(text)
    except ValueError:
        file = context.plugin.filename
        rospy.logwarn("%s: updateRate '%s' is not a number; %s Hz is used", file, text, RATE)
        rate = float(RATE)
    return round(NANOSECONDS / rate) if rate > 0.0 else 0


LIBRARIES = {"libgazebo_ros_joint_state_publisher.so": JointStatePlugin}
