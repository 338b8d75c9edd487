"""A node under the clock of the script that started it (or started what started it)."""

from __future__ import annotations

import argparse
import math
import os
import socket
import sys
from collections.abc import Sequence
from typing import Any

from lockstep_runner.line import ADDRESS, Line, LineEnded
from lockstep_runner.script import AfterImport

# These make up the simulation and the ROS graph.
NOT_FOLLOWING = frozenset(
    ["gazebo", "gzserver", "gzclient", "rosmaster", "roscore", "roslaunch", "rosout", "rosbag"]
)


def watch_for_rospy() -> None:
    """Makes this process follow the clock if it becomes a node."""
    if (
        ADDRESS not in os.environ
        or os.path.basename(sys.argv[0] if sys.argv else "") in NOT_FOLLOWING
    ):
        return
    sys.meta_path.insert(0, AfterImport("rospy", _wrap_init_node))


def _wrap_init_node(rospy: Any) -> None:
    init_node = rospy.init_node

    def init(*args: Any, **kwds: Any) -> None:
        init_node(*args, **kwds)
        if os.path.basename(sys.argv[0]) not in NOT_FOLLOWING:
            _follow(rospy.get_name())

    rospy.init_node = rospy.client.init_node = init


def _follow(name: str) -> None:
    import rospy

    connection = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        connection.connect(os.environ[ADDRESS])
        line = Line(connection)
        line.send(node=name, pid=os.getpid())
    except (OSError, LineEnded):  # the script has ended
        connection.close()
        return
    from lockstep_runner.install import install
    from lockstep_runner.world import ScriptWorld, WorldFailed

    class FollowedWorld(ScriptWorld):
        """The simulator, except that time comes from the script's process."""

        def __init__(self) -> None:
            super().__init__()
            self.longest = sys.maxsize

        def advance(
            self,
            ticks: int,
            until: Sequence[str] = (),
            connect: tuple[Sequence[str], Sequence[str]] | None = None,
        ) -> Any:
            """As ScriptWorld.advance, but time passes only when the script's process says so."""
            if not ticks:
                return super().advance(0, (), connect)
            response = super().advance(0, until)
            response.paused = False  # a follower simply waits while no time passes
            if response.messages:  # they arrived before the rest began
                return response
            passed = _rest(line, math.inf if ticks == sys.maxsize else ticks * self.step)
            if rospy.core.is_shutdown():  # the simulator may have ended, too
                return response
            response = super().advance(0)
            response.paused = False
            response.ticks = round(passed / self.step)
            return response

    def _rest(line: Line, span: float) -> float:
        try:
            line.send(rest=None if span == math.inf else span)
            return float(line.receive()["passed"])
        except (LineEnded, KeyError) as fault:
            if rospy.core.is_shutdown():
                return 0.0
            raise WorldFailed("the script that it followed has ended") from fault

    rospy.core.add_shutdown_hook(lambda reason: line.close())  # ends a rest at Ctrl-C
    options = argparse.Namespace(seed=None, dt=0.001, step_on=["none"], virtual_wall_clock=False)
    install(options, FollowedWorld())
