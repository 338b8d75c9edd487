"""ft_sensor, f3d, bumper: forces on joints and links, contacts (docs/contract/sensors.md 5, 6e, 11.5)."""

from typing import Any

from gazebo_msgs.msg import ContactsState
from geometry_msgs.msg import Vector3, Wrench, WrenchStamped
from std_msgs.msg import Header

from bullet_gazebo.common.messages import from_contact_state, to_contact_state, to_time
from bullet_gazebo.plugins.plugin_loader import PluginContext
from bullet_gazebo.plugins.sensor_topics import SensorPlugin, TopicSource, frame_of
from robot_sim.applied_forces import Wrench as Forces
from robot_sim.physics.description import DescriptionError
from robot_sim.physics.pose import ZERO
from robot_sim.sensors.contact import ContactSensor
from robot_sim.sensors.force_torque import JointForces, LinkForces
from robot_sim.sensors.sensing import sensor_of


class ForcePlugin(SensorPlugin):
    """Publishes forces and torques of the last step.

    They are zero when a service has moved something, and known again two steps later.
    """

    source = TopicSource(WrenchStamped)
    at_once = False
    meter: JointForces | LinkForces  # looks at each step

    def __init__(self, context: PluginContext) -> None:
        self._deviation = context.deviation()
        # Forces are those of one step, so the state of each is looked at, before the measurement.
        context.clock(0.0, self._look, lambda: self._topic.has_subscribers, at_once=False)
        super().__init__(context)

    def _look(self, now: int) -> None:
        moves, _ = self.context.sensing.schedule.last_move(self.context.model)
        self.meter.look(now, moves)

    def forces(self) -> Forces | None:
        """Returns what the meter has found."""
        raise NotImplementedError

    def rate(self) -> float:
        return 0.0

    def measure(self, now: int) -> WrenchStamped | None:
        context, found = self.context, self.forces()
        if found is None:
            if now != context.sensing.schedule.last_move(context.model).at:
                return None
            found = (ZERO, ZERO)
        values = [*found[0], *found[1]]
        if self._deviation:
            values = (context.random(now).normal(0.0, self._deviation, 6) + values).tolist()
        wrench = Wrench(Vector3(*values[:3]), Vector3(*values[3:]))
        return WrenchStamped(Header(stamp=to_time(now), frame_id=self.frame), wrench)


class FtSensorPlugin(ForcePlugin):
    """What the child of a joint exerts on the parent, in the child's axes."""

    meter: JointForces

    def __init__(self, context: PluginContext) -> None:
        name = context.text("jointName", "")
        joint, self._rate = context.among("jointName", context.model.all_joints) or name, 0.0
        if context.sensor is not None:
            sensor = sensor_of(context, ("force_torque",))
            joint, self._rate = joint or sensor.joint, sensor.rate
        if not joint:
            raise DescriptionError("<jointName> is missing")
        self.meter = JointForces(context.sim, context.model, joint)
        super().__init__(context)
        self.frame = frame_of(self.namespace, self.meter.link.rpartition("::")[2])

    def rate(self) -> float:
        return self.context.rate("updateRate", self._rate)

    def forces(self) -> Forces | None:
        return self.meter.wrench()


class F3dPlugin(ForcePlugin):
    """The net force on a link, and the torque about its centre of mass, in world axes."""

    meter: LinkForces

    def __init__(self, context: PluginContext) -> None:
        self._link = context.link("bodyName")
        self.meter = LinkForces(context.sim, context.model, [self._link])
        super().__init__(context)

    def forces(self) -> Forces | None:
        return self.meter.about_centre(self._link)


def read_contacts(message: ContactsState) -> dict[str, Any]:
    """Returns what a bumper's message says."""
    return {"contacts": [from_contact_state(each) for each in message.states]}


class BumperPlugin(SensorPlugin):
    """Publishes what the collisions of `<contact>` touched in the last step, also if that is nothing."""

    source = TopicSource(ContactsState, "bumper_states", tag="bumperTopicName", read=read_contacts)
    measurement = ContactSensor

    def measure(self, now: int) -> ContactsState:
        header = Header(stamp=to_time(now), frame_id=self.frame)
        return ContactsState(header, [to_contact_state(pair) for pair in self.sensor.measure(now)])


LIBRARIES = {
    "libgazebo_ros_bumper.so": BumperPlugin,
    "libgazebo_ros_ft_sensor.so": FtSensorPlugin,
    "libgazebo_ros_f3d.so": F3dPlugin,
}
