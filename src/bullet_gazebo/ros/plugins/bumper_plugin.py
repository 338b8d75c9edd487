"""libgazebo_ros_bumper.so: contacts of a link's collisions (docs/contract/sensors.md 5).

`bumperTopicName` (bumper_states) and `frameName` (world) are read. The frame is only in the header: all
values are in world axes.
"""

import rospy
from gazebo_msgs.msg import ContactsState
from std_msgs.msg import Header

from bullet_gazebo.physics.lumping import LUMPED
from bullet_gazebo.ros.common.messages import NANOSECONDS, to_contact_state, to_time
from bullet_gazebo.ros.plugins.plugin_loader import PluginContext
from bullet_gazebo.ros.plugins.sensor_topics import (
    SensorPlugin,
    SensorTopic,
    frame_of,
    namespace_of,
    sensor_of,
    topic_in,
)
from bullet_gazebo.state import contact_pairs


class BumperPlugin(SensorPlugin):
    """Publishes what the collisions of `<contact>` touched in the last step, also if that is nothing."""

    def __init__(self, context: PluginContext) -> None:
        self._context = context
        sensor = sensor_of(context, ("contact",))
        names = [(each.text or "").strip() for each in sensor.element.findall("contact/collision")]
        model, link = context.model, sensor.link
        found = [collision_named(name, link, list(model.collisions(link))) for name in names]
        for name, taken in zip(names, found, strict=True):
            if taken is None:
                rospy.logwarn(
                    "Sensor '%s': link '%s' has no collision '%s'", sensor.name, link, name
                )
            elif taken != name:
                rospy.loginfo("Sensor '%s': collision '%s' is '%s' here", sensor.name, name, taken)
        self._collisions = {(model.name, link, each) for each in found if each is not None}
        namespace = namespace_of(context, absent="", empty="/")
        self._frame = frame_of(namespace, context.text("frameName", "world"))
        topic = topic_in(namespace, context.text("bumperTopicName", "bumper_states"))
        SensorTopic(context, topic, ContactsState, sensor.rate, self._measure)

    def _measure(self, now: int) -> ContactsState:
        # Contacts are those of the last step, which may have been before a service moved something.
        sim = self._context.sim
        step = round(sim.world.time_step * NANOSECONDS)
        is_stale = now - self._context.sensing.schedule.moved_at <= step
        pairs = []
        if self._collisions and not is_stale:
            pairs = contact_pairs(sim.world, self._collisions)
        header = Header(stamp=to_time(now), frame_id=self._frame)
        return ContactsState(header, [to_contact_state(pair) for pair in pairs])


def collision_named(name: str, link: str, collisions: list[str]) -> str | None:
    """Returns the collision that is meant, whichever way a lumped link's is written."""
    child = name.removeprefix(f"{link}_collision_")
    spellings = (name, f"{link}{LUMPED}{name}", f"{link}{LUMPED}{child}_collision")
    exact = [each for each in spellings if each in collisions]
    # Lumping numbers all but the first collision of a link.
    numbered = [
        each
        for spelling in spellings
        for each in collisions
        if each.startswith(f"{spelling}_") and each.removeprefix(f"{spelling}_").isdigit()
    ]
    return next(iter([*exact, *numbered]), None)


LIBRARIES = {"libgazebo_ros_bumper.so": BumperPlugin}
