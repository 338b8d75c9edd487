"""What a trajectory controller offers beside its state (docs/contract/ros_control.md 3.5)."""

import rospy
from control_msgs.srv import (
    QueryTrajectoryState,
    QueryTrajectoryStateRequest,
    QueryTrajectoryStateResponse,
)
from trajectory_msgs.msg import JointTrajectory

from bullet_gazebo.control.controllers.joint_trajectory import JointTrajectoryController
from bullet_gazebo.control.trajectory_goals import TrajectoryRefused
from bullet_gazebo.ros.control.trajectory_action import TrajectoryAction
from bullet_gazebo.ros.control.trajectory_conversions import to_query_response, to_trajectory
from bullet_gazebo.simulator import Simulator


class TrajectoryPorts:
    """The topic `command`, the action `follow_joint_trajectory` and the service `query_state`."""

    def __init__(
        self, sim: Simulator, controller: JointTrajectoryController, namespace: str
    ) -> None:
        """`namespace` is the controller's."""
        self._sim = sim
        self._controller = controller
        self._action = TrajectoryAction(sim, controller, namespace)
        self._query_state = rospy.Service(
            rospy.names.ns_join(namespace, "query_state"), QueryTrajectoryState, self._query
        )
        self._topic = rospy.names.ns_join(namespace, "command")
        self._command = rospy.Subscriber(
            self._topic, JointTrajectory, self._follow, queue_size=1, tcp_nodelay=True
        )

    def shutdown(self) -> None:
        """Takes all of them away."""
        self._command.unregister()
        self._query_state.shutdown("the controller was unloaded")
        self._action.shutdown()

    def _follow(self, message: JointTrajectory) -> None:
        trajectory = to_trajectory(message)
        try:
            with self._sim.lock:
                warning = self._controller.follow(trajectory)
        except TrajectoryRefused as refusal:
            rospy.logerr("%s: %s", self._topic, refusal)
            return
        if warning:
            rospy.logwarn("%s: %s", self._topic, warning)

    def _query(self, request: QueryTrajectoryStateRequest) -> QueryTrajectoryStateResponse:
        try:
            with self._sim.lock:
                states = self._controller.query(request.time.to_nsec())
        except TrajectoryRefused as refusal:
            raise rospy.ServiceException(str(refusal)) from refusal
        return to_query_response(self._controller.joint_names, states)
