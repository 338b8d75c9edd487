"""One piece of a joint's trajectory: a spline between two waypoints (docs/contract/ros_control.md 3.5)."""

from typing import NamedTuple

NANOSECONDS = 1_000_000_000
Coefficients = tuple[float, float, float, float, float, float]


class Waypoint(NamedTuple):
    """Where a joint shall be [rad, m], and, if given, how fast [1/s] and with what acceleration [1/s²]."""

    position: float
    velocity: float | None = None
    acceleration: float | None = None


class State(NamedTuple):
    """Position [rad, m] of a joint and its first two derivatives by time [s]."""

    position: float = 0.0
    velocity: float = 0.0
    acceleration: float = 0.0


class Segment:
    """The way between two waypoints, each at its time [ns].

    It is as smooth as what both of them say: a line for positions alone, a cubic with velocities, a
    quintic with accelerations. Outside its time the joint stands at the nearer end.
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
    """Returns a segment that stands at `position` [rad, m] from `time` [ns] on."""
    waypoint = Waypoint(position)
    return Segment(time, waypoint, time, waypoint)


def stop_ramp(start: int, state: State, duration: int) -> Segment:
    """Returns a segment that brings `state` to rest within `duration` [ns].

    It is the first half of the quintic that comes back, without acceleration at either end, to where it
    starts: it stops 5/8 of the way that the joint would have gone on.
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
    """Coefficients over s in [0, 1]; in seconds they would lose digits over long times."""
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
