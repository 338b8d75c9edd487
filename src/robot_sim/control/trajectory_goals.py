"""Trajectories as clients send them, and goals of follow_joint_trajectory: checks and outcomes.

See docs/contract/ros_control.md 3.5. What can't be followed raises TrajectoryRefused.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

from robot_sim.constants import NANOSECONDS
from robot_sim.control.errors import ControlError
from robot_sim.control.trajectory import Axis, Waypoint

SUCCESSFUL, INVALID_GOAL, INVALID_JOINTS = 0, -1, -2  # control_msgs/FollowJointTrajectoryResult
PATH_TOLERANCE_VIOLATED, GOAL_TOLERANCE_VIOLATED = -4, -5
MOST_NAMED = 10  # joints of the client in an error text
LARGEST_VALUE = 1e12  # of a position and its derivatives: a spline's coefficients would overflow
SUCCEEDED, ABORTED, CANCELED = "succeeded", "aborted", "canceled"


class TrajectoryRefused(ControlError):
    """A trajectory can't be followed. `code` is FollowJointTrajectory's error code."""

    def __init__(self, code: int, text: str) -> None:
        super().__init__(text)
        self.code = code


class TrajectoryPoint(NamedTuple):
    """trajectory_msgs/JointTrajectoryPoint: `time` is time_from_start [ns]; values in order of joints."""

    time: int
    positions: Sequence[float]
    velocities: Sequence[float] = ()
    accelerations: Sequence[float] = ()

    def waypoint(self, index: int) -> Waypoint:
        """Returns the waypoint of the joint with that index in the trajectory."""
        return Waypoint(
            self.positions[index],
            self.velocities[index] if self.velocities else None,
            self.accelerations[index] if self.accelerations else None,
        )


class Trajectory(NamedTuple):
    """trajectory_msgs/JointTrajectory. It begins at `stamp` [ns], or with the next tick if that is 0."""

    names: Sequence[str]
    points: Sequence[TrajectoryPoint]
    stamp: int = 0


def check_joints(names: Sequence[str], joints: Sequence[str], partial: bool) -> None:
    """Checks that `names` are `joints` in any order, or some of them if `partial`."""
    unknown = [name for name in names if name not in joints]
    missing = [joint for joint in joints if joint not in names]
    fault = ""
    if unknown:
        fault = f"the controller has no joint {unknown[:MOST_NAMED]}; it has {list(joints)}"
    elif len(set(names)) < len(names):
        fault = f"a joint is named twice: {list(names[:MOST_NAMED])}"
    elif not names:
        fault = "it names no joint"
    elif missing and not partial:
        fault = f"it lacks {missing}, and allow_partial_joints_goal is not set"
    if fault:
        raise TrajectoryRefused(INVALID_JOINTS, f"The trajectory's joints don't match: {fault}")


def check_points(trajectory: Trajectory) -> None:
    """Checks that all points are complete, finite and later than the one before."""
    before = -1
    for number, point in enumerate(trajectory.points):
        fault = _fault(point, len(trajectory.names))
        if not fault and point.time <= before:
            fault = (
                f"time_from_start is {point.time / NANOSECONDS} s: it must be more than "
                f"{'the one before' if number else 'or equal to 0'}"
            )
        if fault:
            raise TrajectoryRefused(INVALID_GOAL, f"Point {number} of the trajectory: {fault}")
        before = point.time


def dropped_points(trajectory: Trajectory, elapsed: int) -> tuple[int, str]:
    """Returns how many points are over, `elapsed` [ns] after the trajectory begins, and a warning."""
    points = trajectory.points
    dropped = sum(point.time <= elapsed for point in points)
    if dropped == len(points):
        late = (elapsed - points[-1].time) / NANOSECONDS
        raise TrajectoryRefused(
            INVALID_GOAL,
            f"All {dropped} points of the trajectory lie in the past, the last one by {late:f} s",
        )
    # Most clients begin with a point "now": no warning for that.
    if not dropped or (dropped == 1 and not trajectory.stamp and not points[0].time):
        return dropped, ""
    return dropped, f"The first {dropped} of {len(points)} points lie in the past: left out"


def _fault(point: TrajectoryPoint, joints: int) -> str:
    """Returns the point's fault, or an empty text."""
    if not point.positions:
        return "it has no positions"
    for what, values in zip(point._fields[1:], point[1:], strict=True):
        if values and len(values) != joints:
            return f"it has {len(values)} {what} for {joints} joints"
        bad = [value for value in values if not (math.isfinite(value) and abs(value) <= LARGEST_VALUE)]
        if bad:
            return f"its {what} must be finite and within {LARGEST_VALUE:g}: {bad[0]}"
    return ""


class Tolerance(NamedTuple):
    """control_msgs/JointTolerance of position [rad, m] and velocity [1/s]; 0 or less accepts any error.

    Accelerations aren't measured, so any is accepted.
    """

    position: float = 0.0
    velocity: float = 0.0

    def violation(self, position_error: float, velocity_error: float) -> str:
        """Returns the exceeded tolerance, or an empty text."""
        if 0.0 < self.position < abs(position_error):
            return f"position, tolerance {self.position:g}"
        if 0.0 < self.velocity < abs(velocity_error):
            return f"velocity {velocity_error:f}, tolerance {self.velocity:g}"
        return ""

    def changed(self, wish: "Tolerance | None") -> "Tolerance":
        """Returns the tolerance as a goal changes it: positive overrides, negative disables, 0 keeps."""
        if wish is None:
            return self
        return Tolerance(*(w if w else own for own, w in zip(self, wish, strict=True)))


class GoalOutcome(NamedTuple):
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


class GoalObserver(Protocol):
    """Follows a goal. It is called within a control tick, so it must not wait for anything."""

    def feedback(self, sample: Any) -> None:
        """Takes the state that the controller reports, at action_monitor_rate."""

    def finished(self, outcome: Any) -> None:
        """Takes the outcome; it is the last call."""


class GoalRequest(NamedTuple):
    """A goal as the client sent it; tolerances by joint, `goal_time` [ns]."""

    trajectory: Trajectory
    path: Mapping[str, Tolerance] = {}
    goal: Mapping[str, Tolerance] = {}
    goal_time: int = 0


class MonitoredJoint(NamedTuple):
    """A joint, and its tolerances on the way and at the end."""

    axis: Axis
    path: Tolerance
    goal: Tolerance

    def changed(self, request: GoalRequest) -> "MonitoredJoint":
        """Returns the joint with its tolerances as a goal changes them."""
        path, goal = (each.get(self.axis.joint.name) for each in (request.path, request.goal))
        return MonitoredJoint(self.axis, self.path.changed(path), self.goal.changed(goal))


@dataclass
class Goal:
    """An accepted goal, identified by `key`."""

    key: str
    listener: GoalObserver
    monitored: list[MonitoredJoint]
    start: int  # uptime [ns]
    late: int  # [ns] after its last point, when it must be reached
    outcome: GoalOutcome | None = None  # a success that isn't reported yet

    def check(self, uptime: int) -> GoalOutcome | None:
        """Returns the outcome; None while the joints are on their way."""
        reached = True
        for axis, path, goal in self.monitored:
            if uptime < axis.spline.end:
                reached = False
                fault = (
                    path.violation(axis.position_error, axis.velocity_error) if uptime >= self.start else ""
                )
                if fault:
                    return _aborted(PATH_TOLERANCE_VIOLATED, axis, "path", fault)
            elif fault := goal.violation(axis.position_error, axis.velocity_error):
                reached = False
                if uptime >= axis.spline.end + self.late:
                    return _aborted(GOAL_TOLERANCE_VIOLATED, axis, "goal", fault)
        return GoalOutcome(SUCCEEDED) if reached else None


def check_tolerances(request: GoalRequest) -> None:
    """Checks that all tolerances are numbers: no error ever exceeds NaN."""
    for joint, tolerance in (*request.path.items(), *request.goal.items()):
        if any(math.isnan(value) for value in tolerance):
            raise TrajectoryRefused(INVALID_GOAL, f"A tolerance of joint '{joint}' is not a number")


def _aborted(code: int, axis: Axis, where: str, fault: str) -> GoalOutcome:
    return GoalOutcome(ABORTED, code, f"{axis.joint.name} {where} error {axis.position_error:f} ({fault})")
