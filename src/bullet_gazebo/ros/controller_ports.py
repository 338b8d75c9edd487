"""Topics of a loaded controller: they exist from load to unload (ros_control.md section 1.4)."""

import math
from collections.abc import Callable

import rospy
from control_msgs.msg import JointControllerState
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64

from bullet_gazebo.control.controllers.base import Controller, Input, Output
from bullet_gazebo.ros.conversions import to_joint_controller_state, to_joint_state

OUTPUTS: dict[str, tuple[type, Callable, int]] = {  # kind: message, conversion, queue size
    "JointState": (JointState, to_joint_state, 4),
    "JointControllerState": (JointControllerState, to_joint_controller_state, 1),
}


class ControllerPorts:
    """Publishers and subscribers of one controller."""

    def __init__(self, controller: Controller, namespace: str) -> None:
        """`namespace` is the manager's; the controller's own is below it."""
        own = rospy.names.ns_join(namespace, controller.name)
        self._outputs = controller.outputs
        self._publishers = [
            self._publish(output, namespace if output.shared else own)
            for output in controller.outputs
        ]
        self._subscribers = [self._subscribe(port, own) for port in controller.inputs]

    def _publish(self, output: Output, namespace: str) -> rospy.Publisher:
        kind, convert, queue = OUTPUTS[output.kind]
        publisher = rospy.Publisher(
            rospy.names.ns_join(namespace, output.topic), kind, queue_size=queue, tcp_nodelay=True
        )

        def send(sample: tuple) -> None:
            if publisher.get_num_connections():
                publisher.publish(convert(sample))

        output.sink = send
        return publisher

    def _subscribe(self, port: Input, namespace: str) -> rospy.Subscriber:
        topic = rospy.names.ns_join(namespace, port.topic)

        def receive(message: Float64) -> None:
            if not math.isfinite(message.data):
                rospy.logerr_throttle(
                    1.0, f"{topic}: the command {message.data} is not finite: no effort"
                )
            port.receive(message.data)

        return rospy.Subscriber(topic, Float64, receive, queue_size=1, tcp_nodelay=True)

    def shutdown(self) -> None:
        for output in self._outputs:
            output.sink = None
        for subscriber in self._subscribers:
            subscriber.unregister()
        for publisher in self._publishers:
            publisher.unregister()
