"""Plugins by which clients act on a model: force, hand_of_god, joint_pose_trajectory, wheel_slip.

See docs/contract/sensors.md 11.3 and 11.5.
"""

import math

import rospy
from geometry_msgs.msg import Wrench
from tf2_msgs.msg import TFMessage
from trajectory_msgs.msg import JointTrajectory

from bullet_gazebo.common.dynamic_server import DynamicServer, Parameter
from bullet_gazebo.common.messages import bad_number, from_transform, to_transform, to_vector
from bullet_gazebo.plugins.plugin_loader import PluginContext
from bullet_gazebo.plugins.sensor_topics import ContextPlugin, advertised, namespace_of, subscribe, topic_in
from robot_sim.drives.odometry import Period
from robot_sim.physics.description import DescriptionError
from robot_sim.physics.pose import ZERO, Pose, Vector, rotate, scale, subtract

WORLDS = ("", "world", "map")
SLIPS = [
    Parameter(f"slip_compliance_unitless_{way}", "double", 0.0, 0.0, 20.0)
    for way in ("lateral", "longitudinal")
]


class PushPlugin(ContextPlugin):
    """Pushes a link by the newest wrench, in world axes, until the next one."""

    def __init__(self, context: PluginContext) -> None:
        self._context, self._link = context, context.link("bodyName")
        self._wrench = ZERO, ZERO
        topic = context.required("topicName")
        name = topic_in(namespace_of(context, absent="", empty="/"), topic)
        subscribe(context, name, Wrench, self._receive, 1)
        context.on_update(self._push)

    def _receive(self, message: Wrench) -> None:
        fault = bad_number(message)
        if fault:
            rospy.logerr("Model '%s': a wrench is ignored: %s", self._context.model.name, fault)
            return
        with self._context.sim.lock:
            self._wrench = to_vector(message.force), to_vector(message.torque)

    def _push(self, _: int) -> None:
        self._context.model.body.add_wrench(self._link, *self._wrench)


class HandOfGodPlugin(ContextPlugin):
    """Pulls a link towards a frame of tf by springs that are damped critically."""

    def __init__(self, context: PluginContext) -> None:
        self._context, self._link = context, context.link("linkName")
        frame = context.text("frameId", "hog")
        self._wanted, self._actual = f"{frame}_desired", f"{frame}_actual"
        self._stiffness = context.number("kl", 200.0), context.number("ka", 200.0)
        if min(self._stiffness) < 0.0:
            raise DescriptionError("<kl> and <ka> can't be negative")
        self._frames: dict[str, tuple[str, Pose]] = {}  # each with its parent
        self._tf = advertised(context, "/tf", TFMessage, 100)
        for name in ("/tf", "/tf_static"):
            subscribe(context, name, TFMessage, self._receive, 100)
        context.on_update(self._pull)

    def _receive(self, message: TFMessage) -> None:
        with self._context.sim.lock:
            for each in message.transforms:
                if not bad_number(each.transform):
                    parent, child = (name.lstrip("/") for name in (each.header.frame_id, each.child_frame_id))
                    self._frames[child] = parent, from_transform(each.transform)

    def _target(self) -> Pose | None:
        """Returns where the wanted frame is in the world, if tf says so."""
        name, pose, seen = self._wanted, Pose(), set()
        while name != "world":
            if name in seen or name not in self._frames:
                return None
            seen.add(name)
            name, step = self._frames[name]
            pose = step.compose(pose)
        return pose

    def _pull(self, now: int) -> None:
        model = self._context.model
        pose, (linear, angular) = model.link_state(self._link)
        if self._tf.has_other_subscribers:
            self._tf.publish(to_transform(now, "world", self._actual, pose))
        target = self._target()
        inertia = model.description.links[self._link].inertia
        if target is None or inertia is None:
            return
        x, y, z, w = target.relative_to(pose).orientation
        half = math.copysign(math.hypot(x, y, z), w)
        turn = 2.0 * math.atan2(half, abs(w)) / half if half else 0.0
        away = rotate(pose.orientation, scale((x, y, z), turn))  # [rad], in world axes
        largest = max(inertia.ixx, inertia.iyy, inertia.izz)
        model.body.add_wrench(
            self._link,
            _spring(self._stiffness[0], inertia.mass, subtract(target.position, pose.position), linear),
            _spring(self._stiffness[1], largest, away, angular),
        )  # fmt: skip


def _spring(stiffness: float, inertia: float, way: Vector, speed: Vector) -> Vector:
    damping = 2.0 * math.sqrt(stiffness * inertia)
    return subtract(scale(way, stiffness), scale(speed, damping))


class JointPoseTrajectoryPlugin(ContextPlugin):
    """Puts joints at each point of a trajectory and holds them there, without physics."""

    def __init__(self, context: PluginContext) -> None:
        self._context, self._model = context, context.model
        self._period = Period(context.rate(), context.sim.now)
        self._stop()
        topic = context.text("topicName", "set_joint_trajectory")
        name = topic_in(namespace_of(context, absent="", empty="/"), topic)
        subscribe(context, name, JointTrajectory, self._receive, 100)
        context.on_update(self._update)
        context.on_move(self._moved)

    def _moved(self) -> None:
        if self._resets != self._context.sim.resets:
            self._stop()

    def _stop(self) -> None:
        self._points: list[tuple[int, dict[str, float]]] = []
        self._held: dict[str, float] = {}
        self._end = 0  # [ns]
        self._kept: tuple[str, Pose] | None = None  # a link that stays where it is
        self._period.restart(self._context.sim.now)
        self._resets = self._context.sim.resets

    def _receive(self, message: JointTrajectory) -> None:
        model, frame = self._model, message.header.frame_id
        names = list(message.joint_names)
        unknown = [name for name in names if name not in model.joint_names]
        fault = bad_number(message) or (unknown and f"the model has no joint {', '.join(unknown)}")
        if any(len(point.positions) != len(names) for point in message.points):
            fault = "a point has not as many positions as there are joints"
        if frame.lstrip("/") not in WORLDS and frame not in model.link_names:
            fault = f"the model has no link '{frame}'"
        if fault:
            rospy.logerr("Model '%s': a trajectory is ignored: %s", model.name, fault)
            return
        with self._context.sim.lock:
            self._stop()
            if frame in model.link_names:
                self._kept = frame, model.link_state(frame)[0]
            at = max(message.header.stamp.to_nsec(), self._context.sim.now)
            for point in message.points:
                self._points.append((at, dict(zip(names, point.positions, strict=True))))
                at += max(point.time_from_start.to_nsec(), 0)
            self._end = at

    def _update(self, now: int) -> None:
        if self._points and self._period.is_over(now):
            while self._points and self._points[0][0] <= now:
                self._held = self._points.pop(0)[1]
        if not self._held:
            return
        self._model.set_joint_positions(self._held)
        if self._kept is not None:
            link, pose = self._kept  # the whole model moves so that this link stays
            place = self._model.link_state(link)[0]
            self._model.place(pose.compose(self._model.state()[0].relative_to(place)))
        if not self._points and now >= self._end:
            self._stop()


class WheelSlipPlugin(ContextPlugin):
    """Offers what clients set, without effect: wheels slip as their friction lets them."""

    def __init__(self, context: PluginContext) -> None:
        below = context.plugin.element.findtext("robotNamespace", "").strip() or "wheel_slip"
        scope = topic_in(context.model.name, below)
        context.closing(DynamicServer(SLIPS, lambda wanted, level: wanted, scope).shutdown)


LIBRARIES = {
    "libgazebo_ros_force.so": PushPlugin,
    "libgazebo_ros_hand_of_god.so": HandOfGodPlugin,
    "libgazebo_ros_joint_pose_trajectory.so": JointPoseTrajectoryPlugin,
    "libgazebo_ros_wheel_slip.so": WheelSlipPlugin,
}
