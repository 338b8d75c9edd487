"""The trajectory of one joint: segments in order of time, and how a new one takes over."""

from bisect import bisect_left, bisect_right
from collections.abc import Iterable, Sequence

from bullet_gazebo.control.angles import shortest_distance
from bullet_gazebo.control.trajectory.segment import Segment, State, Waypoint


class JointSpline:
    """Segments in order of time; the last one's end is held for ever. Times are uptime [ns]."""

    __slots__ = ("_segments", "_starts", "end")

    def __init__(self, segments: Sequence[Segment]) -> None:
        """There is at least one segment."""
        self._segments = segments
        self._starts = [segment.start for segment in segments]
        self.end = segments[-1].end

    def at(self, time: int) -> State:
        """Returns the state at `time`."""
        return self._segments[max(0, bisect_right(self._starts, time) - 1)].sample(time)

    def continued(
        self, now: int, start: int, points: Iterable[tuple[int, Waypoint]], turns: bool
    ) -> "JointSpline":
        """Returns a spline that leaves this one at `start`, for points that all lie after `now`.

        What lies before `now` is forgotten. With `turns` the joint is continuous: the points are moved by
        whole turns, so that the first one is the nearest to where the joint then is.
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
