"""Mimic joints, link attacher, grasp fix, vacuum gripper (docs/contract/sensors.md 11.4, 12.3, 12.5).

What the elements of mimic joints and of disable_link say is in the model itself
(physics/files/mechanisms.py): here only `hasPID` is left, whose gains are parameters.
"""

import math
from functools import partial

import rospy
from gazebo_ros_link_attacher.srv import Attach, AttachRequest, AttachResponse
from std_msgs.msg import Bool
from std_srvs.srv import Empty, EmptyResponse

from bullet_gazebo.plugins.plugin_loader import PluginContext
from bullet_gazebo.plugins.sensor_topics import ContextPlugin, SensorTopic, namespace_of, topic_in
from robot_sim.control.errors import ControlError
from robot_sim.control.hardware import GAINS
from robot_sim.control.pid import Pid
from robot_sim.grippers import GraspHold, GripRule, PidFollower, Suction
from robot_sim.physics.description import DescriptionError
from robot_sim.physics.files.mechanisms import DISABLE_LINK_LIBRARY, MIMIC_LIBRARIES
from robot_sim.physics.model import Model
from robot_sim.physics.world import Attachment
from robot_sim.simulator import Simulator

LOOKS, MOST_COUNT = 5.0, 10.0  # a second of simulated time
ANGLE, RELEASE = 120.0, 0.005  # [°], [m]


class MimicPlugin(ContextPlugin):
    """Gives a joint that follows another one the PID that it asks for; without gains it keeps its gear."""

    def __init__(self, context: PluginContext) -> None:
        name = context.among("mimicJoint", list(context.model.description.mimics))
        mimic = context.model.description.mimics.get(name)
        if mimic is None or mimic.pid is None:  # the model has told what is wrong
            return
        namespace = rospy.names.ns_join(rospy.get_namespace(), context.given_namespace or "")
        place = rospy.names.ns_join(namespace, mimic.pid or f"{GAINS}/{name}")
        gains = rospy.get_param(place, None)
        if gains is None:
            return
        try:
            pid = Pid.from_params(gains, place)
        except ControlError as error:
            raise DescriptionError(str(error)) from error
        with context.sim.lock:
            follower = PidFollower(context.model, name, pid)
        self._follower = follower
        context.on_update(follower.update)
        context.on_move(follower.moved)


def _done(context: PluginContext) -> None:
    """The description has no link any more that touches anything."""


class LinkAttacher:
    """A world's services that fix links to each other, and release them."""

    def __init__(self, sim: Simulator) -> None:
        self._sim = sim
        self._services = [
            rospy.Service("/link_attacher_node/attach", Attach, self._attach),
            rospy.Service("/link_attacher_node/detach", Attach, self._detach),
        ]

    def _attach(self, request: AttachRequest) -> AttachResponse:
        key = _names(request)
        with self._sim.lock:
            first, second = self._link(*key[:2]), self._link(*key[2:])
            if first is None or second is None or first == second:
                rospy.logerr("attach: there are no two links '%s::%s' and '%s::%s' to attach", *key)
                return AttachResponse(ok=False)
            self._release(key)
            self._sim.world.attach(first, second)
        return AttachResponse(ok=True)

    def _detach(self, request: AttachRequest) -> AttachResponse:
        with self._sim.lock:
            released = self._release(_names(request))
        return AttachResponse(ok=released)

    def _release(self, key: tuple[str, ...]) -> bool:
        """Ends what joins these links; the world forgets what a deletion or a reset ends."""
        attachments = [each for each in self._sim.world.attachments if _ends(each) == key]
        for attachment in attachments:
            self._sim.world.detach(attachment)
        return bool(attachments)

    def _link(self, model: str, link: str) -> tuple[Model, str] | None:
        other = self._sim.world.models.get(model)
        if other is None or link not in other.link_names or other.description.script is not None:
            return None  # an actor follows its script, and nothing else
        return other, link


def _ends(attachment: Attachment) -> tuple[str, ...]:
    (first, link), (second, its) = attachment.first, attachment.second
    return first.name, link, second.name, its


def _names(request: AttachRequest) -> tuple[str, ...]:
    names = (request.model_name_1, request.link_name_1, request.model_name_2, request.link_name_2)
    return tuple(map(str, names))


class GraspFixPlugin(ContextPlugin):
    """Holds what each `<arm>` grips."""

    def __init__(self, context: PluginContext) -> None:
        most = context.number("max_grip_count", MOST_COUNT)
        rule = GripRule(
            math.radians(context.number("forces_angle_tolerance", ANGLE)),
            int(context.number("grip_count_threshold", most // 2)),
            int(most),
            context.number("release_tolerance", RELEASE),
        )
        arms = context.plugin.element.findall("arm")
        if not arms:
            raise DescriptionError("<arm> is missing")
        holds = []
        for arm in arms:
            palm = (arm.findtext("palm_link") or "").strip()
            fingers = [(each.text or "").strip() for each in arm.findall("gripper_link")]
            for link in (palm, *fingers):
                if link not in context.model.link_names:
                    raise DescriptionError(f"<arm>: the model has no link '{link}'")
            holds.append(GraspHold(context.sim.world, context.model, palm, fingers, rule))
        self._holds, self._sim, self._resets = holds, context.sim, context.sim.resets
        context.on_move(self._moved)
        for hold in holds:
            context.clock(context.rate("update_rate", LOOKS), hold.look, at_once=False)

    def _moved(self) -> None:
        """Lets an episode grip as the first one did."""
        if self._resets != self._sim.resets:
            self._resets = self._sim.resets
            for hold in self._holds:
                hold.forget()


class VacuumPlugin(ContextPlugin):
    """Suction at `bodyName`: services `on` and `off`, and whether something is held on `topicName`."""

    def __init__(self, context: PluginContext) -> None:
        self._context = context
        namespace = namespace_of(context, absent="", empty="/")
        self._suction = Suction(context.sim.world, context.model, context.link("bodyName"))
        topic = topic_in(namespace, context.required("topicName"))
        SensorTopic(context, topic, Bool, 0.0, self._held)
        for name, on in (("on", True), ("off", False)):
            place = topic_in(namespace, name)
            try:
                service = rospy.Service(place, Empty, partial(self._turn, on))
            except rospy.service.ServiceException as error:
                raise DescriptionError(
                    f"there is a service {place} already: give each gripper a <robotNamespace>"
                ) from error
            context.closing(service.shutdown)
        context.on_update(self._suction.update)
        context.closing(partial(self._turn, False))

    def _held(self, now: int) -> Bool:
        return Bool(self._suction.holds())

    def _turn(self, on: bool, *_: object) -> EmptyResponse:
        with self._context.sim.lock:
            self._suction.on = on
            if not on:  # it lets go at once
                self._suction.update(self._context.sim.now)
        return EmptyResponse()


LIBRARIES = dict.fromkeys(MIMIC_LIBRARIES, MimicPlugin) | {
    DISABLE_LINK_LIBRARY: _done,
    "libgazebo_grasp_fix.so": GraspFixPlugin,
    "libgazebo_ros_vacuum_gripper.so": VacuumPlugin,
}
WORLD_LIBRARIES = {"libgazebo_ros_link_attacher.so": LinkAttacher}
