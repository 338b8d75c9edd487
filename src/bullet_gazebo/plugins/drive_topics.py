"""Common base of vehicle plugins: commands, odometry, tf, driven wheels."""

import math
from collections.abc import Sequence

import rospy
from geometry_msgs.msg import Twist
from nav_msgs.msg import Odometry
from sensor_msgs.msg import JointState
from tf2_msgs.msg import TFMessage

from bullet_gazebo.common.messages import bad_number, to_odometry, to_odometry_transform, to_transform
from bullet_gazebo.plugins.plugin_loader import PluginContext
from bullet_gazebo.plugins.sensor_topics import (
    ContextPlugin,
    Topic,
    advertised,
    frame_of,
    subscribe,
    topic_in,
)
from robot_sim.constants import NANOSECONDS
from robot_sim.drives.odometry import POSE, TWIST, OdometrySample, Period, Triple, WheelOdometry
from robot_sim.physics.description import DescriptionError, Joint
from robot_sim.physics.pose import to_rpy
from robot_sim.state_dict import Shared

REPEAT = 1.0  # [s] between two logs of the same complaint
REST = (0.0, 0.0, 0.0)
TRUTHS = {"true": True, "1": True, "false": False, "0": False}


def choice(context: PluginContext, tag: str, default: bool) -> bool:
    """Returns the truth value in the plugin's child element `tag`; of another word it warns."""
    text = context.text(tag, str(default))
    truth = TRUTHS.get(text.lower())
    if truth is None:
        rospy.logwarn(
            "Plugin %s: <%s> is '%s', neither true nor false: %s is used",
            context.plugin.filename, tag, text, default,
        )  # fmt: skip
    return default if truth is None else truth


def length(context: PluginContext, tag: str, default: float) -> float:
    """Returns the positive number in the plugin's child element `tag`."""
    metres = context.number(tag, default)
    if metres <= 0.0:
        raise DescriptionError(f"<{tag}> must be above 0, not {metres}")
    return metres


class DrivePlugin(ContextPlugin):
    """Keeps the newest command, and reports odometry after each period and at once after moves.

    Subclasses have `update` and `sample`, and call `begin` when they are made. `rate` is that of reports [Hz]
    (`late`: see `Period`), `base` the frame of the vehicle without `<robotBaseFrame>`.
    """

    def __init__(
        self,
        context: PluginContext,
        namespace: str,
        rate: float,
        late: bool = True,
        base: str = "base_footprint",
    ) -> None:
        self.context, self.sim, self.model = context, context.sim, context.model
        self.namespace = namespace
        self.command: Triple = REST  # ahead, to the left [m/s], turning [rad/s]
        self.period = Period(rate, self.sim.now, late)
        self.frame = frame_of(namespace, context.text("odometryFrame", "odom"))
        self.child = frame_of(namespace, context.text("robotBaseFrame", base))
        self._odometry: Topic | None = None
        self.tf: Topic | None = None
        self._resets = self.sim.resets
        self._sent = -1  # [ns], stamp of the newest transform

    def begin(self, odometry: bool = True, tf: bool = True, command: str = "cmd_vel") -> None:
        """Opens the topics that are asked for, and takes part in the ticks.

        `command` is the topic of commands without `<commandTopic>`.
        """
        context, text = self.context, self.context.text
        if odometry:
            name = topic_in(self.namespace, text("odometryTopic", "odom"))
            self._odometry = advertised(context, name, Odometry, 1)
        if tf:
            self.tf = advertised(context, "/tf", TFMessage, 100)
        name = topic_in(self.namespace, text("commandTopic", command))
        subscribe(context, name, Twist, self._receive, 1)
        with self.sim.lock:
            self.restart()
        context.on_update(self.update)
        context.on_move(self.moved)

    def update(self, now: int) -> None:
        """Called in each tick, with its time [ns]."""
        raise NotImplementedError

    def sample(self, now: int) -> OdometrySample:
        """Returns the odometry at a time [ns]."""
        raise NotImplementedError

    def restart(self) -> None:
        """Called when it begins, and when the world or the simulation is reset."""

    def report(self, now: int) -> None:
        """Publishes odometry and its transform, as far as they are heard."""
        odometry = self._odometry is not None and self._odometry.has_subscribers
        # A second transform with the same stamp would be refused, with a warning.
        tf = self.tf is not None and self.tf.has_subscribers and now != self._sent
        if not odometry and not tf:
            return
        sample = self.sample(now)
        if self._odometry is not None:
            self._odometry.publish(to_odometry(sample))
        if self.tf is not None and tf:
            self._sent = now
            self.tf.publish(to_odometry_transform(sample))

    def truth(
        self, now: int, pose_covariance: Sequence[float], twist_covariance: Sequence[float]
    ) -> OdometrySample:
        """Returns the model's true pose, and its velocity in its own axes."""
        pose, (linear, angular) = self.model.state()
        yaw = to_rpy(pose.orientation)[2]
        cosine, sine = math.cos(yaw), math.sin(yaw)
        x, y = cosine * linear[0] + sine * linear[1], cosine * linear[1] - sine * linear[0]
        return OdometrySample(
            now, self.frame, self.child, *pose, (x, y, 0.0), (0.0, 0.0, angular[2]),
            pose_covariance, twist_covariance,
        )  # fmt: skip

    def _receive(self, message: Twist) -> None:
        fault = bad_number(message)
        if fault:
            text = f"Model '{self.model.name}': cmd_vel is ignored: {fault}"
            rospy.logerr_throttle(REPEAT, text, logger_name=self.model.name)
            return
        with self.sim.lock:
            self.take((message.linear.x, message.linear.y, message.angular.z))

    def take(self, command: Triple) -> None:
        """Takes a command, under the simulator's lock."""
        self.command = command

    def moved(self) -> None:
        """Called after a service has moved bodies or reset time."""
        now = self.sim.now
        self.period.time_set_back(now)
        if self.sim.resets != self._resets:
            self._resets = self.sim.resets
            self.command = REST
            self.period.restart(now)
            self.restart()
        self.report(now)


class WheeledPlugin(DrivePlugin):
    """A vehicle that may report by the turns of its wheels, and where its joints are.

    Subclasses call `measure_by` when they are made.
    """

    _encoder: WheelOdometry | None = None  # None: the true pose is reported
    _joint_states: Topic | None = None
    _transforms: "LinkTransforms | None" = None
    _driven = 0  # [ns]

    def measure_by(self, separation: float, joints: Sequence[tuple[Joint, str]]) -> None:
        """Reads the elements that choose the reported odometry, of wheels with a separation [m].

        Each joint comes with the name of its child frame.
        """
        context = self.context
        source = context.text("odometrySource", "world")
        if source == "encoder":
            self._encoder = WheelOdometry(separation)
        elif source != "world":
            rospy.logwarn("Plugin %s: no <odometrySource> is called '%s'", context.plugin.filename, source)
        if choice(context, "publishWheelJointState", default=False):
            name = topic_in(self.namespace, "joint_states")
            self._joint_states = advertised(context, name, JointState, 1000)
        if choice(context, "publishWheelTF", default=False):
            self._transforms = LinkTransforms(self, joints)

    def wheel_speeds(self) -> Sequence[float]:
        """Returns the speeds of the left and right wheels that measure [m/s]."""
        raise NotImplementedError

    def joint_state(self, now: int) -> JointState:
        """Returns the message of the joints at a time [ns]."""
        raise NotImplementedError

    def drive(self, seconds: float) -> None:
        """Follows the command, so long after the last call [s]."""
        raise NotImplementedError

    def update(self, now: int) -> None:
        if self._encoder is not None:
            self._encoder.step(self.wheel_speeds(), self.sim.world.time_step)
        if not self.period.is_over(now):
            return
        self.report(now)
        if self._transforms is not None:
            self._transforms.publish(now)
        if self._joint_states is not None and self._joint_states.has_subscribers:
            self._joint_states.publish(self.joint_state(now))
        seconds, self._driven = max(now - self._driven, 0) / NANOSECONDS, now
        self.drive(seconds)

    def sample(self, now: int) -> OdometrySample:
        if self._encoder is not None:
            return self._encoder.sample(now, self.frame, self.child)
        return self.truth(now, POSE, TWIST)

    def restart(self) -> None:
        self._driven = self.sim.now
        if self._encoder is not None:
            self._encoder.restart()


class Wheels(Shared):
    """Driven joints of a vehicle, each a motor with at most a torque [N m], and wheels of a diameter [m].

    `joints` are elements that name them, and the names without them.
    """

    def __init__(
        self, context: PluginContext, joints: dict[str, str], diameter: float, torque: float
    ) -> None:
        self._model = context.model
        self.radius, self._torque = 0.5 * diameter, torque
        self.joints = [joint_of(context, tag, name) for tag, name in joints.items()]
        self._indices = [self._model.joint_index(joint.name) for joint in self.joints]

    def drive(self, speeds: Sequence[float]) -> None:
        """Sets the speeds of the rims [m/s]."""
        for joint, speed in zip(self.joints, speeds, strict=True):
            self._model.set_motor(joint.name, speed / self.radius, self._torque)

    @property
    def speeds(self) -> list[float]:
        """Of the rims [m/s]."""
        states = self._model.body.joint_states()
        return [states[index][1] * self.radius for index in self._indices]


def joint_of(context: PluginContext, tag: str, default: str) -> Joint:
    """Returns the joint that an element names.

    Raises DescriptionError if the model has no such movable joint.
    """
    name = context.text(tag, default)
    if name not in context.model.joint_names:
        raise DescriptionError(f"<{tag}>: the model has no movable joint '{name}'")
    return context.model.description.joints[name]


class LinkTransforms(Shared):
    """Publishes where the links of joints, each with the name of its frame, are in their joints' parents."""

    def __init__(self, drive: DrivePlugin, joints: Sequence[tuple[Joint, str]]) -> None:
        self._model = drive.model
        self._tf = advertised(drive.context, "/tf", TFMessage, 100)
        self._links = []
        for joint, child in joints:
            frames = frame_of(drive.namespace, joint.parent), frame_of(drive.namespace, child)
            self._links.append((joint.parent, joint.child, frames))

    def publish(self, now: int) -> None:
        """Publishes one message for each joint at a time [ns], if they are heard."""
        for parent, child, frames in self._links if self._tf.has_subscribers else ():
            above, below = (self._model.link_state(link)[0] for link in (parent, child))
            self._tf.publish(to_transform(now, *frames, below.relative_to(above)))
