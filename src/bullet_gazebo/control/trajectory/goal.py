"""A goal of follow_joint_trajectory: whether it is reached, missed or still on its way."""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple, Protocol

from bullet_gazebo.control.trajectory.axis import Axis
from bullet_gazebo.control.trajectory.message import (
    GOAL_TOLERANCE_VIOLATED,
    INVALID_GOAL,
    PATH_TOLERANCE_VIOLATED,
    SUCCESSFUL,
    Trajectory,
    TrajectoryRefused,
)
from bullet_gazebo.control.trajectory.tolerances import Constraints, Tolerance

SUCCEEDED, ABORTED, CANCELED = "succeeded", "aborted", "canceled"


class Outcome(NamedTuple):
    """How a goal ended; `code` is FollowJointTrajectory's error code."""

    kind: str
    code: int = SUCCESSFUL
    text: str = ""


class TrajectorySample(NamedTuple):
    """control_msgs/JointTrajectoryControllerState; values in the order of `names`. [rad, m, 1/s, 1/s²]"""

    stamp: int  # [ns]
    names: tuple[str, ...]
    desired: tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]
    actual: tuple[tuple[float, ...], tuple[float, ...]]
    error: tuple[tuple[float, ...], tuple[float, ...]]


class GoalListener(Protocol):
    """Hears of a goal from within a control tick, so it must not wait for anything."""

    def feedback(self, sample: TrajectorySample) -> None:
        """Where the joints are; at action_monitor_rate."""

    def finished(self, outcome: Outcome) -> None:
        """The end; nothing comes after it."""


class GoalRequest(NamedTuple):
    """A goal as the client sent it; tolerances by joint, `goal_time` [ns]."""

    trajectory: Trajectory
    path: Mapping[str, Tolerance] = {}
    goal: Mapping[str, Tolerance] = {}
    goal_time: int = 0


class MonitoredJoint(NamedTuple):
    """A joint of a goal, and its tolerances on the way and at the end."""

    axis: Axis
    path: Tolerance
    goal: Tolerance


class Goal:
    """An accepted goal. `key` identifies it; `outcome` is a success that wasn't told yet."""

    def __init__(
        self,
        key: str,
        listener: GoalListener,
        monitored: list[MonitoredJoint],
        start: int,
        late: int,
    ) -> None:
        """It begins at uptime `start` [ns], and may end `late` [ns] after its last point."""
        self.key = key
        self.listener = listener
        self.outcome: Outcome | None = None
        self._monitored = monitored
        self._start = start
        self._late = late

    def check(self, uptime: int) -> Outcome | None:
        """Returns the outcome, None while the joints are on their way."""
        reached = True
        for axis, path, goal in self._monitored:
            if uptime < axis.spline.end:
                reached = False
                fault = (
                    path.violation(axis.position_error, axis.velocity_error)
                    if uptime >= self._start
                    else ""
                )
                if fault:
                    return _aborted(PATH_TOLERANCE_VIOLATED, axis, "path", fault)
            elif fault := goal.violation(axis.position_error, axis.velocity_error):
                reached = False
                if uptime >= axis.spline.end + self._late:
                    return _aborted(GOAL_TOLERANCE_VIOLATED, axis, "goal", fault)
        return Outcome(SUCCEEDED) if reached else None


def check_tolerances(request: GoalRequest) -> None:
    """Returns if all tolerances are numbers: no error would ever exceed what is none.

    Raises:
        TrajectoryRefused: if one isn't.
    """
    for joint, tolerance in (*request.path.items(), *request.goal.items()):
        if any(math.isnan(value) for value in tolerance):
            raise TrajectoryRefused(INVALID_GOAL, f"A tolerance of joint '{joint}' is not a number")


def monitored_joints(
    request: GoalRequest, axes: Sequence[Axis], constraints: Constraints
) -> tuple[list[MonitoredJoint], int]:
    """Returns the goal's joints with their tolerances, and how late [ns] they may come."""
    wanted = request.trajectory.names
    monitored = [
        MonitoredJoint(
            axis,
            path.changed(request.path.get(axis.joint.name)),
            goal.changed(request.goal.get(axis.joint.name)),
        )
        for axis, path, goal in zip(axes, constraints.path, constraints.goal, strict=True)
        if axis.joint.name in wanted
    ]
    late = max(0, request.goal_time) if request.goal_time else constraints.goal_time
    return monitored, late


def _aborted(code: int, axis: Axis, where: str, fault: str) -> Outcome:
    return Outcome(
        ABORTED, code, f"{axis.joint.name} {where} error {axis.position_error:f} ({fault})"
    )
