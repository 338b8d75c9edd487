"""A node under the clock of the script that started it (or started what started it).

Script and node exchange one JSON object per line over a socket.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import socket
import sys
from typing import Any

from lockstep_runner.script import AfterImport

ADDRESS = "LOCKSTEP_CLOCK"  # environment variable: path of the script process's socket


class LineEnded(Exception):
    """The other side has closed the connection."""


class Line:
    """A connection that carries JSON objects."""

    def __init__(self, connection: socket.socket) -> None:
        self._connection = connection
        self._reader = connection.makefile("r", encoding="utf-8")

    def send(self, **content: Any) -> None:
        """Sends an object; raises LineEnded if the other side has gone."""
        try:
            self._connection.sendall(json.dumps(content).encode() + b"\n")
        except OSError as fault:
            raise LineEnded from fault

    def receive(self) -> dict[str, Any]:
        """Waits for the next object and returns it.

        Raises:
            LineEnded: the other side has gone, or sent no JSON object.
        """
        try:
            line = self._reader.readline()
            content = json.loads(line) if line.endswith("\n") else None
        except (OSError, ValueError) as fault:
            raise LineEnded from fault
        if not isinstance(content, dict):
            raise LineEnded
        return content

    def close(self) -> None:
        """Closes the connection for both sides."""
        with contextlib.suppress(OSError):
            self._connection.shutdown(socket.SHUT_RDWR)
        self._connection.close()


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

    from lockstep_runner.replaced import install
    from lockstep_runner.world import FollowedWorld

    connection = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        connection.connect(os.environ[ADDRESS])
        line = Line(connection)
        line.send(node=name, pid=os.getpid())
    except (OSError, LineEnded):  # the script has ended
        connection.close()
        return
    rospy.core.add_shutdown_hook(lambda reason: line.close())  # ends a rest at Ctrl-C
    options = argparse.Namespace(seed=None, dt=0.001, step_on=["none"], virtual_wall_clock=False)
    install(options, FollowedWorld(line))
