"""The node's time and its XML-RPC server; see the package's docstring.

- `answer_xmlrpc`: a node can't answer one XML-RPC call more (gazebo_ros.test, `gz`)
- `stop_hearing_clock`: who makes /clock hears it over a socket to itself (gazebo_parameters.test)
- `set_time`: and so has to tell rospy the time by itself (gazebo_ros.test, a plugin)
"""

from collections.abc import Callable
from typing import Any

import genpy
import rospy
import rospy.impl.simtime
from rospy.impl.masterslave import ROSHandler


def answer_xmlrpc(method: str, answer: Callable[..., tuple[int, str, Any]]) -> None:
    """Has this process's node answer one XML-RPC call more, as it does those of master and tools.

    rospy looks a call up among its handler's methods, has one handler for the process, and makes it itself.

    Args:
        method: the call's name.
        answer: called with what follows the caller's name, whatever it is; returns code (1 is success),
            text, value.
    """

    def handle(_handler: ROSHandler, *args: Any) -> tuple[int, str, Any]:
        return answer(*args[1:])  # the first one is the caller's name

    setattr(ROSHandler, method, handle)


def stop_hearing_clock() -> None:
    """Ends rospy's own subscription to the topic that this node itself publishes. See `set_time`.

    With /use_sim_time every node hears /clock. For the node that makes the time that is a message a
    millisecond over a socket to itself, a good part of its CPU time.
    """
    subscription = getattr(rospy.impl.simtime, "_clock_sub", None)
    if subscription is not None:
        subscription.unregister()


def set_time(now: genpy.Time) -> None:
    """Tells this process's rospy the simulated time, as a message on /clock does elsewhere."""
    rospy.rostime._set_rostime(now)
