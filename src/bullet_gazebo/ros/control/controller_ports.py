"""Topics of a loaded controller: they exist from load to unload (docs/contract/ros_control.md 1.4)."""

import math
import traceback
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from typing import Any

import rospy
from control_msgs.msg import JointControllerState, JointTrajectoryControllerState
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, Float64MultiArray

from bullet_gazebo.control.controllers.base import Controller, Input, Output
from bullet_gazebo.control.controllers.joint_trajectory import JointTrajectoryController
from bullet_gazebo.control.errors import ControlError, faults
from bullet_gazebo.control.manager import ControllerManager
from bullet_gazebo.ros.control.pid_ports import PidPorts
from bullet_gazebo.ros.control.trajectory_conversions import to_controller_state
from bullet_gazebo.ros.control.trajectory_ports import TrajectoryPorts
from bullet_gazebo.ros.wire.conversions import to_joint_controller_state, to_joint_state
from bullet_gazebo.ros.wire.thinning import ThinnedTopic, Thinner
from bullet_gazebo.simulator import Simulator

OUTPUTS: dict[
    str, tuple[type, Callable[[Any], Any], int]
] = {  # kind: message, conversion, queue size
    "JointState": (JointState, to_joint_state, 4),
    "JointControllerState": (JointControllerState, to_joint_controller_state, 1),
    "TrajectorySample": (JointTrajectoryControllerState, to_controller_state, 1),
}
INPUTS: dict[
    str, tuple[type, Callable[[Any], Any]]
] = {  # kind: message, what the controller gets of it
    "Float64": (Float64, lambda message: message.data),
    "Float64MultiArray": (Float64MultiArray, lambda message: message.data),
}
REPEAT = 1.0  # [s]; how often the same complaint about a topic is logged


class ControllerPorts:
    """Publishers and subscribers of one controller, and what tunes its PIDs."""

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
        self._closing = ExitStack()  # what shutdown() takes away, the last one first
        with ExitStack() as opened:  # if one can't be opened, those before it are closed
            opened.callback(self.shutdown)
            self._open(controller, namespace)
            opened.pop_all()

    def _open(self, controller: Controller, namespace: str) -> None:
        own = rospy.names.ns_join(namespace, controller.name)
        for output in controller.outputs:
            self._publish(output, namespace if output.shared else own)
        for place, pid in controller.pids.items():
            ports = PidPorts(
                self._sim, self._thinner, pid, rospy.names.ns_join(own, place),
                self._manager.loops_changed,
            )  # fmt: skip
            self._closing.callback(ports.shutdown)
        if isinstance(controller, JointTrajectoryController):
            self._closing.callback(TrajectoryPorts(self._sim, controller, own).shutdown)
        for port in controller.inputs:
            self._subscribe(port, own)

    def _publish(self, output: Output, namespace: str) -> None:
        kind, convert, queue = _output(output.kind)
        publisher = rospy.Publisher(
            rospy.names.ns_join(namespace, output.topic), kind, queue_size=queue, tcp_nodelay=True
        )
        self._closing.callback(publisher.unregister)
        topic = ThinnedTopic(
            self._thinner,
            publisher.resolved_name,
            lambda sample: _deliver(publisher, convert(sample)),
        )
        self._closing.callback(topic.close)

        def send(sample: object) -> None:
            if isinstance(output.kind, type) and not isinstance(sample, output.kind):
                raise TypeError(f"{publisher.name} takes {output.kind.__name__}, not {sample!r}")
            if publisher.get_num_connections():
                topic.send(sample)

        output.sink, output.listeners = send, publisher.get_num_connections
        self._closing.callback(_mute, output)

    def _subscribe(self, port: Input, namespace: str) -> None:
        topic = rospy.names.ns_join(namespace, port.topic)
        kind, read = _input(port.kind)

        def receive(message: object) -> None:
            command = read(message)
            if port.kind in INPUTS and not _finite(command):
                rospy.logerr_throttle(
                    REPEAT, f"{topic}: a command is not finite: no effort, or the place is held"
                )
            try:
                with self._sim.lock:
                    port.receive(command)
            except ControlError as error:
                rospy.logerr_throttle(REPEAT, f"{topic}: {error}")
            except faults() as error:  # a user's code: the message is lost, the topic goes on
                text = "".join(traceback.format_exception(error))
                rospy.logerr_throttle(
                    REPEAT, f"{topic}: a message is lost, its reader raised:\n{text}"
                )

        subscriber = rospy.Subscriber(topic, kind, receive, queue_size=1, tcp_nodelay=True)
        self._closing.callback(subscriber.unregister)

    def shutdown(self) -> None:
        """Takes all of them away."""
        self._closing.close()


def _deliver(publisher: rospy.Publisher, message: Any) -> None:
    """Publishes; what a user's controller put into a message must not end the thread that sends for all."""
    try:
        publisher.publish(message)
    except rospy.ROSException as error:
        rospy.logerr_throttle(REPEAT, f"{publisher.name}: a message is lost: {error}")


def _mute(output: Output) -> None:
    output.sink = None


def _output(kind: str | type) -> tuple[type, Callable[[Any], Any], int]:
    return OUTPUTS[kind] if isinstance(kind, str) else (kind, _as_it_is, 1)


def _input(kind: str | type) -> tuple[type, Callable[[Any], Any]]:
    return INPUTS[kind] if isinstance(kind, str) else (kind, _as_it_is)


def _finite(command: float | Sequence[float]) -> bool:
    values = (command,) if isinstance(command, float) else command
    return all(math.isfinite(value) for value in values)


def _as_it_is(message: Any) -> Any:
    return message
