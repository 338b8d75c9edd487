"""libgazebo_ros_ft_sensor.so and libgazebo_ros_f3d.so: WrenchStampeds (docs/contract/sensors.md 6e, 11.5).

The first one reads `jointName`, `topicName` (both required), `updateRate` (0: every step) and
`gaussianNoise` (0); it also works below a `<sensor type="force_torque">` of a joint. The second one reads
`bodyName`, `topicName` (both required) and `frameName` (world), which only names the frame: its axes are the
world's.
"""

from geometry_msgs.msg import Vector3, Wrench, WrenchStamped
from std_msgs.msg import Header

from bullet_gazebo.applied_forces import Wrench as Forces
from bullet_gazebo.physics.description import DescriptionError
from bullet_gazebo.physics.pose import ZERO
from bullet_gazebo.ros.common.messages import to_time
from bullet_gazebo.ros.plugins.plugin_loader import PluginContext
from bullet_gazebo.ros.plugins.sensor_topics import (
    SensorPlugin,
    SensorTopic,
    frame_of,
    namespace_of,
    topic_in,
)
from bullet_gazebo.sensors.force_torque import JointForces, LinkForces
from bullet_gazebo.sensors.sensing import sensor_of


class ForcePlugin(SensorPlugin):
    """Publishes forces and torques of the last step.

    They are zero when a service has moved something, and known again two steps later.
    """

    def __init__(
        self, context: PluginContext, meter: JointForces | LinkForces, frame: str, rate: float
    ) -> None:
        self._context = context
        self._meter = meter
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

    def _forces(self) -> Forces | None:
        raise NotImplementedError

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
        self._joint = JointForces(context.sim, context.model, joint)
        frame = self._joint.link.rpartition("::")[2]
        super().__init__(context, self._joint, frame, context.rate("updateRate", rate))

    def _forces(self) -> Forces | None:
        return self._joint.wrench()


class F3dPlugin(ForcePlugin):
    """The net force on a link, and the torque about its centre of mass, in world axes."""

    def __init__(self, context: PluginContext) -> None:
        self._link = context.link("bodyName")
        self._net = LinkForces(context.sim, context.model, [self._link])
        super().__init__(context, self._net, context.text("frameName", "world"), 0.0)

    def _forces(self) -> Forces | None:
        return self._net.about_centre(self._link)


LIBRARIES = {
    "libgazebo_ros_ft_sensor.so": FtSensorPlugin,
    "libgazebo_ros_f3d.so": F3dPlugin,
}
