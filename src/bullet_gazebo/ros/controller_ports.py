"""Topics of a loaded controller: they exist from load to unload (ros_control.md section 1.4)."""

import math
from collections.abc import Callable, Sequence
from typing import Any

import rospy
from control_msgs.msg import JointControllerState, JointTrajectoryControllerState
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, Float64MultiArray

from bullet_gazebo.control.controllers.base import Controller, Input, Output
from bullet_gazebo.control.controllers.joint_trajectory import JointTrajectoryController
from bullet_gazebo.control.errors import ControlError
from bullet_gazebo.ros.conversions import to_joint_controller_state, to_joint_state
from bullet_gazebo.ros.pid_ports import PidPorts
from bullet_gazebo.ros.thinning import ThinnedTopic, Thinner
from bullet_gazebo.ros.trajectory_conversions import to_controller_state
from bullet_gazebo.ros.trajectory_ports import TrajectoryPorts
from bullet_gazebo.simulator import Simulator

OUTPUTS: dict[str, tuple[type, Callable, int]] = {  # kind: message, conversion, queue size
    "JointState": (JointState, to_joint_state, 4),
    "JointControllerState": (JointControllerState, to_joint_controller_state, 1),
    "TrajectorySample": (JointTrajectoryControllerState, to_controller_state, 1),
}
INPUTS: dict[str, tuple[type, Callable]] = {  # kind: message, what the controller gets of it
    "Float64": (Float64, lambda message: message.data),
    "Float64MultiArray": (Float64MultiArray, lambda message: message.data),
}
REPEAT = 1.0  # [s]; how often the same complaint about a topic is logged


class ControllerPorts:
    """Publishers and subscribers of one controller, and what tunes its PIDs."""

    def __init__(
        self, sim: Simulator, thinner: Thinner, controller: Controller, namespace: str
    ) -> None:
        """`namespace` is the manager's; the controller's own is below it."""
        own = rospy.names.ns_join(namespace, controller.name)
        self._sim = sim
        self._thinner = thinner
        self._topics: list[ThinnedTopic] = []
        self._outputs = controller.outputs
        self._publishers = [
            self._publish(output, namespace if output.shared else own)
            for output in controller.outputs
        ]
        self._pids = [
            PidPorts(sim, thinner, pid, rospy.names.ns_join(own, place))
            for place, pid in controller.pids.items()
        ]
        self._subscribers = [self._subscribe(port, own) for port in controller.inputs]
        self._trajectory: TrajectoryPorts | None = None
        if isinstance(controller, JointTrajectoryController):
            self._trajectory = TrajectoryPorts(sim, controller, own)

    def _publish(self, output: Output, namespace: str) -> rospy.Publisher:
        kind, convert, queue = _output(output.kind)
        publisher = rospy.Publisher(
            rospy.names.ns_join(namespace, output.topic), kind, queue_size=queue, tcp_nodelay=True
        )

        topic = ThinnedTopic(self._thinner, lambda sample: publisher.publish(convert(sample)))
        self._topics.append(topic)

        def send(sample: object) -> None:
            if publisher.get_num_connections():
                topic.send(sample)

        output.sink = send
        return publisher

    def _subscribe(self, port: Input, namespace: str) -> rospy.Subscriber:
        topic = rospy.names.ns_join(namespace, port.topic)
        kind, read = _input(port.kind)

        def receive(message: object) -> None:
            command = read(message)
            if port.kind in INPUTS and not _finite(command):
                rospy.logerr_throttle(REPEAT, f"{topic}: {command} is not finite: no effort")
            try:
                with self._sim.lock:
                    port.receive(command)
            except ControlError as error:
                rospy.logerr_throttle(REPEAT, f"{topic}: {error}")

        return rospy.Subscriber(topic, kind, receive, queue_size=1, tcp_nodelay=True)

    def shutdown(self) -> None:
        """Takes all of them away."""
        for output in self._outputs:
            output.sink = None
        for subscriber in self._subscribers:
            subscriber.unregister()
        if self._trajectory is not None:
            self._trajectory.shutdown()
        for pid in self._pids:
            pid.shutdown()
        for topic in self._topics:
            topic.close()
        for publisher in self._publishers:
            publisher.unregister()


def _output(kind: str | type) -> tuple[type, Callable[[Any], Any], int]:
    return OUTPUTS[kind] if isinstance(kind, str) else (kind, _as_it_is, 1)


def _input(kind: str | type) -> tuple[type, Callable[[Any], Any]]:
    return INPUTS[kind] if isinstance(kind, str) else (kind, _as_it_is)


def _finite(command: float | Sequence[float]) -> bool:
    values = (command,) if isinstance(command, float) else command
    return all(math.isfinite(value) for value in values)


def _as_it_is(message: Any) -> Any:
    return message
