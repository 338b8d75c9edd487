"""Trajectories of joints: splines between waypoints, and the axis that follows them.

See docs/contract/ros_control.md 3.5.
"""

from bisect import bisect_left, bisect_right
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

from robot_sim.constants import NANOSECONDS
from robot_sim.control.joint import JointHandle, shortest_distance
from robot_sim.control.pid import Pid
from robot_sim.state_dict import Stateful, load

Coefficients = tuple[float, float, float, float, float, float]


class Waypoint(NamedTuple):
    """A wanted position of a joint [rad, m], optionally with velocity [1/s] and acceleration [1/s²]."""

    position: float
    velocity: float | None = None
    acceleration: float | None = None


class State(NamedTuple):
    """Position [rad, m] of a joint and its first two derivatives by time [s]."""

    position: float = 0.0
    velocity: float = 0.0
    acceleration: float = 0.0


class Segment(Stateful):
    """A spline between two waypoints, each at its time [ns].

    It is linear for positions alone, a cubic if both have velocities, a quintic if both have accelerations.
    Outside of its time the joint rests at the nearer end.
    """

    __slots__ = ("_coefficients", "_first", "_last", "_seconds", "_span", "end", "start")

    def __init__(self, start: int, first: Waypoint, end: int, last: Waypoint) -> None:
        self.start = start
        self.end = end
        self._span = end - start
        self._seconds = self._span / NANOSECONDS
        self._first = first.position
        self._last = last.position
        self._coefficients = _spline(first, last, self._seconds)

    def sample(self, time: int) -> State:
        """Returns the state at `time` [ns]."""
        if time > self.end or not self._span:
            return State(self._last)
        if time < self.start:
            return State(self._first)
        s = (time - self.start) / self._span
        c0, c1, c2, c3, c4, c5 = self._coefficients
        seconds = self._seconds
        return State(
            c0 + s * (c1 + s * (c2 + s * (c3 + s * (c4 + s * c5)))),
            (c1 + s * (2.0 * c2 + s * (3.0 * c3 + s * (4.0 * c4 + s * 5.0 * c5)))) / seconds,
            (2.0 * c2 + s * (6.0 * c3 + s * (12.0 * c4 + s * 20.0 * c5))) / (seconds * seconds),
        )


def still(time: int, position: float) -> Segment:
    """Returns a segment that rests at `position` [rad, m] from `time` [ns] on."""
    waypoint = Waypoint(position)
    return Segment(time, waypoint, time, waypoint)


def stop_ramp(start: int, state: State, duration: int) -> Segment:
    """Returns a segment that brings `state` to rest within `duration` [ns].

    It is the first half of the quintic that returns to its start without acceleration at either end. It
    stops after 5/8 of the distance that the joint would have travelled.
    """
    seconds = duration / NANOSECONDS
    goes_on = state.velocity * seconds
    return Segment(
        start,
        Waypoint(state.position, state.velocity, 0.0),
        start + duration,
        Waypoint(state.position + 0.625 * goes_on, 0.0, -1.5 * state.velocity / seconds),
    )


def _spline(first: Waypoint, last: Waypoint, seconds: float) -> Coefficients:
    """Returns coefficients over s in [0, 1]: in seconds they would lose digits over long times."""
    way = last.position - first.position
    if first.velocity is None or last.velocity is None:
        return (first.position, way, 0.0, 0.0, 0.0, 0.0)
    v0, v1 = first.velocity * seconds, last.velocity * seconds
    if first.acceleration is None or last.acceleration is None:
        return (first.position, v0, 3.0 * way - 2.0 * v0 - v1, v0 + v1 - 2.0 * way, 0.0, 0.0)
    a0, a1 = first.acceleration * seconds**2, last.acceleration * seconds**2
    return (
        first.position,
        v0,
        0.5 * a0,
        10.0 * way - 6.0 * v0 - 4.0 * v1 - 1.5 * a0 + 0.5 * a1,
        -15.0 * way + 8.0 * v0 + 7.0 * v1 + 1.5 * a0 - a1,
        6.0 * way - 3.0 * (v0 + v1) + 0.5 * (a1 - a0),
    )


class JointSpline(Stateful):
    """The trajectory of a joint: segments in order of time, then rest. Times are uptime [ns]."""

    __slots__ = ("_segments", "_starts", "end")
    non_persistent = ("_starts", "end")

    def __init__(self, segments: Sequence[Segment]) -> None:
        """`segments`: at least one."""
        self._lay(segments)

    def _lay(self, segments: Sequence[Segment]) -> None:
        self._segments = segments
        self._starts = [segment.start for segment in segments]
        self.end = segments[-1].end

    def load_state_dict(self, state: Mapping[str, Any]) -> None:
        made = [Segment.__new__(Segment) for _ in state["_segments"]]
        load((one, each.state) for one, each in zip(made, state["_segments"], strict=True))
        self._lay(made)

    def at(self, time: int) -> State:
        """Returns the state at `time`."""
        return self._segments[max(0, bisect_right(self._starts, time) - 1)].sample(time)

    def continued(
        self, now: int, start: int, points: Iterable[tuple[int, Waypoint]], turns: bool
    ) -> "JointSpline":
        """Returns a spline that leaves this one at `start` for `points`, all of them after `now`.

        Segments before `now` are dropped. If the joint `turns` without limits, the points are moved by whole
        turns, so that the first one is as near as possible.
        """
        first = max(0, bisect_right(self._starts, now) - 1)
        segments = list(self._segments[first : bisect_left(self._starts, start)])
        state = self.at(start)
        before, waypoint = start, Waypoint(*state)
        shift: float | None = None if turns else 0.0
        for time, point in points:
            if shift is None:
                nearest = state.position + shortest_distance(state.position, point.position)
                shift = nearest - point.position
            target = point._replace(position=point.position + shift)
            segments.append(Segment(before, waypoint, time, target))
            before, waypoint = time, target
        return JointSpline(segments)


class Axis(Stateful):
    """Moves a joint along its spline. Errors are desired minus actual [rad, m] and [rad/s, m/s].

    Without a PID the command is a position; with one, a velocity or an effort.
    """

    __slots__ = (
        "desired", "joint", "position_error", "pid", "velocity_error", "spline", "velocity_ff",
    )  # fmt: skip

    def __init__(self, joint: JointHandle, pid: Pid | None = None, velocity_ff: float = 0.0) -> None:
        self.joint = joint
        self.pid = pid
        self.velocity_ff = velocity_ff
        self.position_error = self.velocity_error = 0.0
        self.desired = State(joint.position)
        self.spline = JointSpline([still(0, joint.position)])

    def begin(self, duration: int) -> None:
        """Starts at uptime 0 from the joint's present state, and stops within `duration` [ns]."""
        joint = self.joint
        self.position_error = self.velocity_error = 0.0
        self.desired = State(joint.position, joint.velocity)
        self._stop(0, self.desired, duration)
        if self.pid is None:
            joint.command = joint.position
        else:
            joint.command = 0.0
            self.pid.clear()

    def hold(self, start: int, duration: int) -> None:
        """Stops from uptime `start` [ns] on: at once where the joint is, or in a ramp of `duration` [ns]."""
        self._stop(start, self.spline.at(start), duration)

    def _stop(self, start: int, state: State, duration: int) -> None:
        ramp = stop_ramp(start, state, duration) if duration > 0 else None
        self.spline = JointSpline([ramp or still(start, self.joint.position)])

    def follow(self, now: int, start: int, points: list[tuple[int, Waypoint]]) -> None:
        """Leaves the present spline at uptime `start` [ns] for `points`, all of them after `now`."""
        turns = self.joint.kind == "continuous"
        self.spline = self.spline.continued(now, start, points, turns)

    def update(self, uptime: int, dt: float) -> None:
        """One control tick at `uptime` [ns], `dt` [s] after the last one."""
        joint = self.joint
        self.desired = desired = self.spline.at(uptime)
        # Upstream takes the shortest turn on a rail, too: a joint that is more than pi metres off would go
        # the wrong way.
        if joint.kind == "prismatic":
            self.position_error = desired.position - joint.position
        else:
            self.position_error = shortest_distance(joint.position, desired.position)
        self.velocity_error = desired.velocity - joint.velocity
        if self.pid is None:
            joint.command = desired.position
        else:
            feedback = self.pid.compute_with_rate(self.position_error, self.velocity_error, dt)
            joint.command = self.velocity_ff * desired.velocity + feedback
