"""ft_sensor, f3d and bumper: forces on joints and links, and contacts (docs/contract/sensors.md 5, 6e, 11.5).

The first one reads `jointName`, `topicName` (both required), `updateRate` (0: every step) and
`gaussianNoise` (0); it also works below a `<sensor type="force_torque">` of a joint. The second one reads
`bodyName`, `topicName` (both required) and `frameName` (world), the third one `bumperTopicName`
(bumper_states) and `frameName` (world). Of these two the frame is only a name: the axes are the world's.
"""

from collections.abc import Callable
from functools import partial

from gazebo_msgs.msg import ContactsState
from geometry_msgs.msg import Vector3, Wrench, WrenchStamped
from std_msgs.msg import Header

from bullet_gazebo.applied_forces import Wrench as Forces
from bullet_gazebo.physics.description import DescriptionError
from bullet_gazebo.physics.pose import ZERO
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
from bullet_gazebo.sensors.force_torque import JointForces, LinkForces
from bullet_gazebo.sensors.sensing import sensor_of


class ForcePlugin(SensorPlugin):
    """Publishes forces and torques of the last step.

    They are zero when a service has moved something, and known again two steps later.
    """

    def __init__(
        self,
        context: PluginContext,
        meter: JointForces | LinkForces,
        forces: Callable[[], Forces | None],
        frame: str,
        rate: float,
    ) -> None:
        """`meter` looks at each step, `forces` returns what it has found."""
        self._context, self._meter, self._forces = context, meter, forces
        self._deviation = context.deviation()
        topic = context.required("topicName")
        namespace = namespace_of(context, absent="", empty="/")
        self._frame = frame_of(namespace, frame)
        # Forces are those of one step, so the state of each is looked at, before the measurement.
        context.clock(0.0, self._look, lambda: self._topic.is_heard, at_once=False)
        full = topic_in(namespace, topic)
        self._topic = SensorTopic(context, full, WrenchStamped, rate, self._measure, at_once=False)

    def _look(self, now: int) -> None:
        moves, _ = self._context.sensing.schedule.last_move(self._context.model)
        self._meter.look(now, moves)

    def _measure(self, now: int) -> WrenchStamped | None:
        found = self._forces()
        if found is None:
            if now != self._context.sensing.schedule.last_move(self._context.model).at:
                return None
            found = (ZERO, ZERO)
        values = [*found[0], *found[1]]
        if self._deviation:
            random = self._context.sensing.noise(self._context.model, self._context.key, now)
            values = (random.normal(0.0, self._deviation, 6) + values).tolist()
        wrench = Wrench(Vector3(*values[:3]), Vector3(*values[3:]))
        return WrenchStamped(Header(stamp=to_time(now), frame_id=self._frame), wrench)


class FtSensorPlugin(ForcePlugin):
    """What the child of a joint exerts on the parent, in the child's axes."""

    def __init__(self, context: PluginContext) -> None:
        name = context.text("jointName", "")
        joint, rate = context.among("jointName", context.model.all_joints) or name, 0.0
        if context.sensor is not None:
            sensor = sensor_of(context, ("force_torque",))
            joint, rate = joint or sensor.joint, sensor.rate
        if not joint:
            raise DescriptionError("<jointName> is missing")
        meter = JointForces(context.sim, context.model, joint)
        frame, rate = meter.link.rpartition("::")[2], context.rate("updateRate", rate)
        super().__init__(context, meter, meter.wrench, frame, rate)


class F3dPlugin(ForcePlugin):
    """The net force on a link, and the torque about its centre of mass, in world axes."""

    def __init__(self, context: PluginContext) -> None:
        link = context.link("bodyName")
        net = LinkForces(context.sim, context.model, [link])
        frame = context.text("frameName", "world")
        super().__init__(context, net, partial(net.about_centre, link), frame, 0.0)


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


LIBRARIES = {
    "libgazebo_ros_bumper.so": BumperPlugin,
    "libgazebo_ros_ft_sensor.so": FtSensorPlugin,
    "libgazebo_ros_f3d.so": F3dPlugin,
}
