"""A node under the clock of the script that started it (or started what started it)."""

import argparse
import os
import socket
import sys
from typing import Any

from lockstep_runner.concurrency.line import Line, LineEnded
from lockstep_runner.script import ADDRESS, AfterImport

# These make up the simulation and the ROS graph.
NOT_FOLLOWING = frozenset(
    ["gazebo", "gzserver", "gzclient", "rosmaster", "roscore", "roslaunch", "rosout", "rosbag"]
)


def watch_for_rospy() -> None:
    """Makes this process follow the clock if it becomes a node."""
    if ADDRESS not in os.environ or os.path.basename(sys.argv[0] if sys.argv else "") in NOT_FOLLOWING:
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

    from lockstep_runner.concurrency import python_threads
    from lockstep_runner.concurrency.followed_world import FollowedWorld
    from lockstep_runner.replaced import install

    connection = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        connection.connect(os.environ[ADDRESS])
        line = Line(connection)
        line.send(node=name, pid=os.getpid())
    except (OSError, LineEnded):  # the script has ended
        connection.close()
        return
    rospy.core.add_shutdown_hook(lambda reason: line.close())  # ends a rest at Ctrl-C
    options = argparse.Namespace(seed=None, dt=0.0, step_on=["none"], virtual_wall_clock=False)
    python_threads.replace(install(options, FollowedWorld(line)))
