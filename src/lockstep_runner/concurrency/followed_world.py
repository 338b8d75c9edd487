"""The simulator of a node that follows a script's clock."""

import math
import sys
from collections.abc import Sequence

import rospy
from bullet_gazebo_msgs.srv import AdvanceWorldResponse

from lockstep_runner.concurrency.line import Line, LineEnded
from lockstep_runner.world import ScriptWorld, WorldFailed


class FollowedWorld(ScriptWorld):
    """Its time comes from the script's process."""

    def __init__(self, line: Line) -> None:
        super().__init__()
        self.longest = sys.maxsize
        self._line = line

    def advance(
        self, ticks: int, until: Sequence[str] = (),
        connect: tuple[Sequence[str], Sequence[str]] | None = None,
    ) -> AdvanceWorldResponse:  # fmt: skip
        """As ScriptWorld.advance, but time passes only when the script's process says so."""
        if not ticks:
            return super().advance(0, (), connect)
        response = super().advance(0, until)
        response.paused = False  # a follower simply waits while no time passes
        if response.messages:  # they arrived before the rest began
            return response
        passed = self._rest(math.inf if ticks == sys.maxsize else ticks * self.step)
        if rospy.core.is_shutdown():  # the simulator may have ended, too
            return response
        response = super().advance(0)
        response.paused = False
        response.ticks = round(passed / self.step)
        return response

    def _rest(self, span: float) -> float:
        """Rests for at most `span` of simulated time; returns how much has passed, both in [ns]."""
        try:
            self._line.send(rest=None if span == math.inf else span)
            return float(self._line.receive()["passed"])
        except (LineEnded, KeyError) as fault:
            if rospy.core.is_shutdown():
                return 0.0
            raise WorldFailed from fault  # the script has told of its end, for all that followed it
