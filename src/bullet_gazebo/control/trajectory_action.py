"""Actions of trajectory and gripper controllers (docs/contract/ros_control.md 3.5, sensors.md 13.1)."""

from collections.abc import Iterable
from typing import Any

import rospy
from control_msgs import msg, srv
from std_msgs.msg import Header
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from bullet_gazebo.common.messages import to_time
from bullet_gazebo.control.actions import ControllerAction
from robot_sim.control.controllers.gripper import GripperOutcome, GripperSample
from robot_sim.control.controllers.joint_trajectory import JointTrajectoryController
from robot_sim.control.errors import ControlError
from robot_sim.control.trajectory_goals import (
    GoalObserver,
    GoalOutcome,
    GoalRequest,
    Tolerance,
    Trajectory,
    TrajectoryPoint,
    TrajectoryRefused,
    TrajectorySample,
)
from robot_sim.simulator import Simulator


class TrajectoryTopics:
    """The topic `command`, the action `follow_joint_trajectory` and the service `query_state`."""

    def __init__(self, sim: Simulator, controller: JointTrajectoryController, namespace: str) -> None:
        """`namespace` is the controller's."""
        self._sim = sim
        self._controller = controller
        self._action = TrajectoryAction(sim, controller, namespace)
        self._query_state = rospy.Service(
            rospy.names.ns_join(namespace, "query_state"), srv.QueryTrajectoryState, self._query
        )
        self._topic = rospy.names.ns_join(namespace, "command")
        self._command = rospy.Subscriber(
            self._topic, JointTrajectory, self._follow, queue_size=1, tcp_nodelay=True
        )

    def shutdown(self) -> None:
        """Closes all of them."""
        self._command.unregister()
        self._query_state.shutdown("the controller was unloaded")
        self._action.shutdown()

    def _follow(self, message: JointTrajectory) -> None:
        trajectory = _to_trajectory(message)
        try:
            with self._sim.lock:
                warning = self._controller.follow(trajectory)
        except TrajectoryRefused as refusal:
            rospy.logerr("%s: %s", self._topic, refusal)
            return
        if warning:
            rospy.logwarn("%s: %s", self._topic, warning)

    def _query(self, request: srv.QueryTrajectoryStateRequest) -> srv.QueryTrajectoryStateResponse:
        try:
            with self._sim.lock.glance():
                states = self._controller.query(request.time.to_nsec())
        except TrajectoryRefused as refusal:
            raise rospy.ServiceException(str(refusal)) from refusal
        names = self._controller.joint_names
        return srv.QueryTrajectoryStateResponse(names, *zip(*states, strict=True))


class TrajectoryAction(ControllerAction):
    """The action `follow_joint_trajectory`."""

    action, name = msg.FollowJointTrajectoryAction, "follow_joint_trajectory"

    def pursue(self, key: str, goal: msg.FollowJointTrajectoryGoal, listener: GoalObserver) -> str:
        request = GoalRequest(
            _to_trajectory(goal.trajectory),
            _tolerances(goal.path_tolerance),
            _tolerances(goal.goal_tolerance),
            goal.goal_time_tolerance.to_nsec(),
        )
        return str(self._controller.pursue(key, request, listener))

    def feedback(self, sample: TrajectorySample) -> msg.FollowJointTrajectoryFeedback:
        return msg.FollowJointTrajectoryFeedback(*_fields(sample))

    def result(self, outcome: GoalOutcome | TrajectoryRefused) -> msg.FollowJointTrajectoryResult:
        text = outcome.text if isinstance(outcome, GoalOutcome) else str(outcome)
        return msg.FollowJointTrajectoryResult(outcome.code, text)


class GripperAction(ControllerAction):
    """The action `gripper_cmd`."""

    action, name = msg.GripperCommandAction, "gripper_cmd"

    def pursue(self, key: str, goal: msg.GripperCommandGoal, listener: GoalObserver) -> str:
        self._controller.pursue(key, goal.command.position, goal.command.max_effort, listener)
        return ""

    def feedback(self, sample: GripperSample) -> msg.GripperCommandFeedback:
        return msg.GripperCommandFeedback(*sample)

    def result(self, outcome: GripperOutcome | ControlError) -> msg.GripperCommandResult:
        if isinstance(outcome, ControlError):
            return msg.GripperCommandResult()
        return msg.GripperCommandResult(*outcome.sample)


def to_controller_state(sample: TrajectorySample) -> msg.JointTrajectoryControllerState:
    return msg.JointTrajectoryControllerState(*_fields(sample))


def _fields(sample: TrajectorySample) -> tuple[Any, ...]:
    """Returns header, names, desired, actual, error: the fields of state and feedback, in their order."""
    points = [
        JointTrajectoryPoint(**dict(zip(("positions", "velocities", "accelerations"), values, strict=False)))
        for values in (sample.desired, sample.actual, sample.error)
    ]
    return Header(stamp=to_time(sample.stamp)), sample.names, *points


def _to_trajectory(message: JointTrajectory) -> Trajectory:
    """Converts the message without its efforts."""
    points = tuple(
        TrajectoryPoint(p.time_from_start.to_nsec(), p.positions, p.velocities, p.accelerations)
        for p in message.points
    )
    return Trajectory(tuple(message.joint_names), points, message.header.stamp.to_nsec())


def _tolerances(tolerances: Iterable[msg.JointTolerance]) -> dict[str, Tolerance]:
    return {each.name: Tolerance(each.position, each.velocity) for each in tolerances}
