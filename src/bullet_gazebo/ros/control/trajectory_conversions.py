"""Between our records of trajectories and ROS messages."""

from collections.abc import Iterable, Sequence
from typing import Any

from control_msgs.msg import (
    FollowJointTrajectoryFeedback,
    FollowJointTrajectoryGoal,
    JointTolerance,
    JointTrajectoryControllerState,
)
from control_msgs.srv import QueryTrajectoryStateResponse
from std_msgs.msg import Header
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from bullet_gazebo.control.trajectory import State
from bullet_gazebo.control.trajectory_goals import (
    GoalRequest,
    Tolerance,
    Trajectory,
    TrajectoryPoint,
    TrajectorySample,
)
from bullet_gazebo.ros.wire.conversions import to_time


def to_trajectory(msg: JointTrajectory) -> Trajectory:
    """Returns what the message wants; efforts are left out."""
    points = tuple(
        TrajectoryPoint(p.time_from_start.to_nsec(), p.positions, p.velocities, p.accelerations)
        for p in msg.points
    )
    return Trajectory(tuple(msg.joint_names), points, msg.header.stamp.to_nsec())


def to_request(goal: FollowJointTrajectoryGoal) -> GoalRequest:
    return GoalRequest(
        to_trajectory(goal.trajectory),
        _tolerances(goal.path_tolerance),
        _tolerances(goal.goal_tolerance),
        goal.goal_time_tolerance.to_nsec(),
    )


def _tolerances(tolerances: Iterable[JointTolerance]) -> dict[str, Tolerance]:
    return {each.name: Tolerance(each.position, each.velocity) for each in tolerances}


def to_controller_state(sample: TrajectorySample) -> JointTrajectoryControllerState:
    return JointTrajectoryControllerState(*_fields(sample))


def to_feedback(sample: TrajectorySample) -> FollowJointTrajectoryFeedback:
    return FollowJointTrajectoryFeedback(*_fields(sample))


def _fields(sample: TrajectorySample) -> tuple[Any, ...]:
    """Header, names, desired, actual, error: the fields of both messages, in their order."""
    points = (_point(*values) for values in (sample.desired, sample.actual, sample.error))
    return Header(stamp=to_time(sample.stamp)), sample.names, *points


def _point(
    positions: Sequence[float], velocities: Sequence[float], accelerations: Sequence[float] = ()
) -> JointTrajectoryPoint:
    return JointTrajectoryPoint(
        positions=positions, velocities=velocities, accelerations=accelerations
    )


def to_query_response(
    names: Sequence[str], states: Sequence[State]
) -> QueryTrajectoryStateResponse:
    return QueryTrajectoryStateResponse(names, *zip(*states, strict=True))
