"""Topics of controllers and PIDs, from load to unload (docs/contract/ros_control.md 1.4 and 4)."""

import math
import traceback
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from functools import partial
from typing import Any

import rospy
from control_msgs.msg import JointControllerState, JointTrajectoryControllerState, PidState
from dynamic_reconfigure.encoding import Config
from four_wheel_steering_msgs.msg import FourWheelSteeringStamped
from geometry_msgs.msg import TwistStamped, WrenchStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Imu, JointState
from tf2_msgs.msg import TFMessage

from bullet_gazebo.common.dynamic_server import FIRST, DynamicServer, Parameter
from bullet_gazebo.common.messages import (
    to_four_wheel_steering,
    to_joint_controller_state,
    to_joint_state,
    to_odometry,
    to_odometry_transform,
    to_sensor_imu,
    to_sensor_wrench,
    to_time,
    to_twist_stamped,
)
from bullet_gazebo.common.publishing import ThinnedTopic, Thinner
from bullet_gazebo.control.trajectory_action import GripperAction, TrajectoryTopics, to_controller_state
from robot_sim.control.controllers.base import Controller, Input, Output
from robot_sim.control.controllers.gripper import GripperActionController
from robot_sim.control.controllers.joint_trajectory import JointTrajectoryController
from robot_sim.control.errors import ControlError, faults
from robot_sim.control.manager import ControllerManager
from robot_sim.control.pid import Gains, Pid, PidSample
from robot_sim.simulator import Simulator
from ros_calls.commands import COMMANDS

Convert = Callable[[Any], Any]

OUTPUTS: dict[str, tuple[type, Convert, int]] = {  # kind: message, conversion, queue size
    "JointState": (JointState, to_joint_state, 4),
    "JointControllerState": (JointControllerState, to_joint_controller_state, 1),
    "TrajectorySample": (JointTrajectoryControllerState, to_controller_state, 1),
    "OdometrySample": (Odometry, to_odometry, 100),
    "TransformSample": (TFMessage, to_odometry_transform, 100),
    "SteeringSample": (FourWheelSteeringStamped, to_four_wheel_steering, 100),
    "InertialSample": (Imu, to_sensor_imu, 4),
    "Wrench": (WrenchStamped, to_sensor_wrench, 4),
    "TwistSample": (TwistStamped, to_twist_stamped, 100),
}
REPEAT = 1.0  # [s] between two logs of the same complaint
MOST = 100_000.0
GAINS = [
    Parameter("p", "double", 0.0, -MOST, MOST, "Proportional gain."),
    Parameter("i", "double", 0.0, -MOST, MOST, "Integral gain."),
    Parameter("d", "double", 0.0, -1000.0, 1000.0, "Derivative gain."),
    Parameter("i_clamp_min", "double", 0.0, -MOST, 0.0, "Least integral term."),
    Parameter("i_clamp_max", "double", 0.0, 0.0, MOST, "Most integral term."),
    Parameter("antiwindup", "bool", False, False, True, "Clamp the integral, not only its term."),
]


class ControllerTopics:
    """Publishers and subscribers of one controller, and the reconfigure servers of its PIDs."""

    def __init__(
        self,
        sim: Simulator,
        thinner: Thinner,
        manager: ControllerManager,
        controller: Controller,
        namespace: str,
    ) -> None:
        """`namespace` is the manager's; the controller's own is below it."""
        self._sim = sim
        self._manager = manager
        self._thinner = thinner
        self._closing = ExitStack()  # what shutdown() closes, the last one first
        with ExitStack() as opened:  # if one can't be opened, those before it are closed
            opened.callback(self.shutdown)
            self._open(controller, namespace)
            opened.pop_all()

    def _open(self, controller: Controller, namespace: str) -> None:
        own = rospy.names.ns_join(namespace, controller.name)
        for output in controller.outputs:
            self._publish(output, namespace if output.shared else own)
        for place, pid in controller.pids.items():
            full = rospy.names.ns_join(own, place)
            topics = PidTopics(self._sim, self._thinner, pid, full, self._manager.loops_changed)
            self._closing.callback(topics.shutdown)
        if controller.tunables:
            self._closing.callback(self._tuner(controller, own).shutdown)
        if isinstance(controller, JointTrajectoryController):
            self._closing.callback(TrajectoryTopics(self._sim, controller, own).shutdown)
        if isinstance(controller, GripperActionController):
            self._closing.callback(GripperAction(self._sim, controller, own).shutdown)
        for port in controller.inputs:
            self._subscribe(port, own)

    def _publish(self, output: Output, namespace: str) -> None:
        # A user's controller names a message type, and sends messages as they are.
        kind, convert, queue = (
            OUTPUTS[output.kind] if isinstance(output.kind, str) else (output.kind, _unchanged, 1)
        )
        publisher = rospy.Publisher(
            rospy.names.ns_join(namespace, output.topic), kind, queue_size=queue, tcp_nodelay=True
        )
        self._closing.callback(publisher.unregister)
        forward: Callable[[Any], None] = partial(_publish, publisher, convert)
        if not output.whole:
            topic = ThinnedTopic(self._thinner, publisher.resolved_name, forward)
            self._closing.callback(topic.close)
            forward = topic.send

        def send(sample: object) -> None:
            if isinstance(output.kind, type) and not isinstance(sample, output.kind):
                raise TypeError(f"{publisher.name} takes {output.kind.__name__}, not {sample!r}")
            if publisher.get_num_connections():
                forward(sample)

        output.sink, output.listeners = send, publisher.get_num_connections
        self._closing.callback(setattr, output, "sink", None)

    def _tuner(self, controller: Controller, namespace: str) -> DynamicServer:
        """Returns the reconfigure server of a controller's own parameters."""
        initial = {name: value for name, (value, _, _) in controller.tunables.items()}
        parameters = [
            Parameter(name, "bool" if isinstance(value, bool) else "double", value, least, most)
            for name, (value, least, most) in controller.tunables.items()
        ]

        def apply(config: Config, level: int) -> Config:
            if level == FIRST:
                config.update(initial)
            elif all(math.isfinite(config[name]) for name in initial):
                with self._sim.lock:
                    controller.tune(config)
            return config

        return DynamicServer(parameters, apply, namespace)

    def _subscribe(self, port: Input, namespace: str) -> None:
        topic = rospy.names.ns_join(namespace, port.topic)
        command_kind = COMMANDS[port.kind] if isinstance(port.kind, str) else None
        read: Convert = command_kind.read if command_kind else _unchanged
        of_joints = command_kind and (command_kind.single or command_kind.listed)
        kind: Any = command_kind.message_type if command_kind else port.kind

        def receive(message: object) -> None:
            command = read(message)
            if of_joints and not _finite(command):
                rospy.logerr_throttle(
                    REPEAT, f"{topic}: a command is not finite: no effort, or the position is held"
                )
            try:
                with self._sim.lock:
                    port.receive(command)
            except ControlError as error:
                rospy.logerr_throttle(REPEAT, f"{topic}: {error}")
            except faults() as error:  # a user's code: the message is lost, the topic continues
                text = "".join(traceback.format_exception(error))
                rospy.logerr_throttle(REPEAT, f"{topic}: a message is lost, its reader raised:\n{text}")

        subscriber = rospy.Subscriber(topic, kind, receive, queue_size=1, tcp_nodelay=True)
        self._closing.callback(subscriber.unregister)
        port.publishers = subscriber.get_num_connections

    def shutdown(self) -> None:
        """Closes all of them."""
        self._closing.close()


def _unchanged(message: Any) -> Any:
    return message


def _publish(publisher: rospy.Publisher, convert: Convert, sample: Any) -> None:
    """Publishes a sample; a user's bad message must not end the thread that sends for all."""
    try:
        publisher.publish(convert(sample))
    except rospy.ROSException as error:
        rospy.logerr_throttle(REPEAT, f"{publisher.name}: a message is lost: {error}")


def _finite(command: float | Sequence[float]) -> bool:
    values = (command,) if isinstance(command, float) else command
    return all(math.isfinite(value) for value in values)


class PidTopics:
    """A reconfigure server in the PID's namespace, and `state` below it if the PID publishes its state.

    Gains are written back to the parameter server, at the start and whenever they change.
    """

    def __init__(
        self, sim: Simulator, thinner: Thinner, pid: Pid, namespace: str, changed: Callable[[], None]
    ) -> None:
        """`changed` is called under the simulator's lock when the gains change."""
        self._sim = sim
        self._pid = pid
        self._namespace = namespace
        self._changed = changed
        self._server = DynamicServer(GAINS, self._apply, namespace)
        self._publisher: rospy.Publisher | None = None
        if pid.publish_state:
            self._publisher = rospy.Publisher(f"{namespace}/state", PidState, queue_size=1)
            self._topic = ThinnedTopic(thinner, self._publisher.resolved_name, self._publisher.publish)
            pid.sink, pid.listeners = self._publish, self._publisher.get_num_connections

    def shutdown(self) -> None:
        """Closes all of it."""
        self._server.shutdown()
        self._pid.sink = None
        if self._publisher is not None:
            self._topic.close()
            self._publisher.unregister()

    def _apply(self, config: Config, level: int) -> Config:
        if level != FIRST:
            wrong = [each.name for each in GAINS if not math.isfinite(config[each.name])]
            if wrong:
                rospy.logerr("%s: %s must be finite; the gains stay", self._namespace, wrong)
            else:
                with self._sim.lock:
                    self._pid.gains = Gains(
                        config["p"], config["i"], config["d"], config["i_clamp_max"],
                        config["i_clamp_min"], bool(config["antiwindup"]),
                    )  # fmt: skip
                    self._changed()
        gains = self._pid.gains
        config.update(
            p=gains.p, i=gains.i, d=gains.d, i_clamp_min=gains.i_min, i_clamp_max=gains.i_max,
            antiwindup=gains.antiwindup,
        )  # fmt: skip
        return config

    def _publish(self, sample: PidSample) -> None:
        publisher = self._publisher
        if publisher is None or not publisher.get_num_connections():
            return
        message = PidState(**sample._asdict())
        message.timestep = rospy.Duration.from_sec(sample.timestep)
        message.header.stamp = to_time(self._sim.now)
        self._topic.send(message)
