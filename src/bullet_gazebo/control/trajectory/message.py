"""A trajectory as a client sends it, and what of it can't be done (docs/contract/ros_control.md 3.5)."""

import math
from collections.abc import Sequence
from typing import NamedTuple

from bullet_gazebo.control.errors import ControlError
from bullet_gazebo.control.trajectory.segment import NANOSECONDS, Waypoint

SUCCESSFUL, INVALID_GOAL, INVALID_JOINTS = 0, -1, -2  # control_msgs/FollowJointTrajectoryResult
PATH_TOLERANCE_VIOLATED, GOAL_TOLERANCE_VIOLATED = -4, -5
MOST_NAMED = 10  # joints in an error text
LARGEST = 1e12  # of a position and its derivatives; beyond it a spline's figures would overflow


class TrajectoryRefused(ControlError):
    """A trajectory that can't be followed. `code` is FollowJointTrajectory's error code."""

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
        """Returns the point of the joint with that place in the trajectory."""
        return Waypoint(
            self.positions[index],
            self.velocities[index] if self.velocities else None,
            self.accelerations[index] if self.accelerations else None,
        )


class Trajectory(NamedTuple):
    """trajectory_msgs/JointTrajectory; it begins at `stamp` [ns], or with the next tick if that is 0."""

    names: Sequence[str]
    points: Sequence[TrajectoryPoint]
    stamp: int = 0


def check_joints(names: Sequence[str], joints: Sequence[str], partial: bool) -> None:
    """Returns if `names` are `joints` in any order, or with `partial` some of them.

    Raises:
        TrajectoryRefused: if they aren't.
    """
    unknown = [name for name in names if name not in joints]
    missing = [joint for joint in joints if joint not in names]
    fault = ""
    if unknown:
        fault = f"the controller has no joint {_shortened(unknown)}; it has {list(joints)}"
    elif len(set(names)) < len(names):
        fault = f"a joint is named twice: {_shortened(names)}"
    elif not names:
        fault = "it names no joint"
    elif missing and not partial:
        fault = f"it lacks {missing}, and allow_partial_joints_goal is not set"
    if fault:
        raise TrajectoryRefused(INVALID_JOINTS, f"The trajectory's joints don't match: {fault}")


def _shortened(names: Sequence[str]) -> str:
    """A list of names for a text that goes into the log and to the client."""
    rest = len(names) - MOST_NAMED
    return str(list(names[:MOST_NAMED])) + (f" and {rest} more" if rest > 0 else "")


def check_points(trajectory: Trajectory) -> None:
    """Returns if all points are whole, finite, and later than the one before.

    Raises:
        TrajectoryRefused: if one isn't.
    """
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
    """Returns how many points come too late, `elapsed` [ns] after the trajectory begins, and a warning.

    Raises:
        TrajectoryRefused: if all of them do.
    """
    points = trajectory.points
    dropped = sum(point.time <= elapsed for point in points)
    if dropped == len(points):
        late = (elapsed - points[-1].time) / NANOSECONDS
        raise TrajectoryRefused(
            INVALID_GOAL,
            f"All {dropped} points of the trajectory lie in the past, the last one by {late:f} s",
        )
    # Most clients begin with a point "now", so it is no news that it is over.
    if not dropped or (dropped == 1 and not trajectory.stamp and not points[0].time):
        return dropped, ""
    return dropped, f"The first {dropped} of {len(points)} points lie in the past: left out"


def _fault(point: TrajectoryPoint, joints: int) -> str:
    """Returns what is wrong with the point, or nothing."""
    if not point.positions:
        return "it has no positions"
    for what, values in zip(point._fields[1:], point[1:], strict=True):
        if values and len(values) != joints:
            return f"it has {len(values)} {what} for {joints} joints"
        bad = [value for value in values if not (math.isfinite(value) and abs(value) <= LARGEST)]
        if bad:
            return f"its {what} must be finite and within {LARGEST:g}: {bad[0]}"
    return ""
