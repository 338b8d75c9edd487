"""Changes of rospy: the node's XML-RPC server, its time, and its registration at the master.

- `answer_xmlrpc`: rospy has no way to answer one more XML-RPC call (gazebo_ros.test, `gz`)
- `stop_hearing_clock`, `set_time`: the node that publishes /clock would hear it over a socket to itself
  (gazebo_parameters.test, gazebo_ros.test)
- `register_again`: rospy doesn't register at a master that was started again (test_master_watch.py)
"""

from collections.abc import Callable
from typing import Any

import genpy
import rospy
import rospy.impl.registration
import rospy.impl.simtime
from rospy.impl.masterslave import ROSHandler
from rospy.impl.registration import RegManager

from ros_calls import master
from ros_calls.master import Refused


def answer_xmlrpc(method: str, answer: Callable[..., tuple[int, str, Any]]) -> None:
    """Makes this process's node answer one XML-RPC call more.

    Args:
        method: the call's name.
        answer: called with the arguments behind the caller's name, of any number and type; returns code
            (1 is success), text, value.
    """

    # rospy looks a call up among the methods of its one handler, which it makes itself.
    def handle(_handler: ROSHandler, _caller: object = None, *args: Any) -> tuple[int, str, Any]:
        return answer(*args)

    setattr(ROSHandler, method, handle)


def stop_hearing_clock() -> None:
    """Ends rospy's own subscription to /clock. See `set_time`.

    With /use_sim_time every node hears /clock. In the node that publishes it, that is a message a millisecond
    over a socket to itself, a good part of its CPU time.
    """
    subscription = getattr(rospy.impl.simtime, "_clock_sub", None)
    if subscription is not None:
        subscription.unregister()


def set_time(now: genpy.Time) -> None:
    """Sets the simulated time of this process's rospy, as a message on /clock does in other nodes."""
    rospy.rostime._set_rostime(now)


def witness() -> tuple[str, str]:
    """Returns name and address of a service that each node registers at its start, and never again."""
    name = rospy.resolve_name("~get_loggers")
    return name, dict(rospy.impl.registration.get_service_manager().get_services())[name]


def register_again(timeout: float) -> None:
    """Registers all topics and services of this node at the master, the witness last.

    Args:
        timeout: of each call [s].

    Raises:
        NoAnswer: the master has gone again.
    """
    topics = rospy.impl.registration.get_topic_manager()
    with topics.lock:
        publications, subscriptions = topics.get_publications(), topics.get_subscriptions()
    for name, kind in publications:
        _register("registerPublisher", name, kind, timeout)
    for name, kind in subscriptions:
        publishers = _register("registerSubscriber", name, kind, timeout)
        for listener in rospy.impl.registration.get_registration_listeners().listeners:
            if publishers and isinstance(listener, RegManager):
                listener.publisher_update(name, publishers)
    last = witness()
    services = rospy.impl.registration.get_service_manager().get_services()
    for name, address in [*(each for each in services if each != last), last]:
        _register("registerService", name, address, timeout)


def _register(method: str, name: str, what: str, timeout: float) -> list[str]:
    """Registers one topic or service; returns a topic's publishers where the master names them."""
    own = (rospy.get_name(), name, what, rospy.core.get_node_uri())
    try:
        answer = master.call_plain(master.uri(), method, *own, timeout=timeout)
    except Refused as refusal:
        rospy.logerr("%s of %s: the master refuses it: %s", method, name, refusal)
        return []
    return answer if isinstance(answer, list) else []
