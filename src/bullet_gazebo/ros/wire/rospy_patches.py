"""All that is changed inside rospy, or reached by its private names: rospy offers no other way to it.

Each function below is one patch, for the simulator's own node and for its process only. All were seen to be
needed with rospy 1.15.15 (Debian 12), and are held by the test that is named.

- `greet_clients_apart`: a client that says nothing keeps all others out (gazebo_clients.test)
- `hang_up_on_nonsense`: a client whose request can't be read waits for ever (gazebo_clients.test)
- `answer_xmlrpc`: a node can't answer one XML-RPC call more (gazebo_ros.test, `gz`)
- `stop_hearing_clock`: who makes /clock hears it over a socket to itself (gazebo_parameters.test)
- `wait_until_sent`: what was published just before a topic is closed is thrown away (test_rospy_patches.py)
- `set_time`: and so has to tell rospy the time by itself (gazebo_ros.test, a plugin)

Classes that merely override a method stand where they are used: `SteadyActionServer` (actionlib),
`DynamicServer` (dynamic_reconfigure), and `model_services.py`'s response without a header.
"""

import socket
import threading
import time
from collections.abc import Callable
from typing import Any

import genpy
import rospy
import rospy.impl.simtime
import rospy.impl.tcpros_base
from rospy.exceptions import TransportException
from rospy.impl.masterslave import ROSHandler
from rospy.impl.tcpros_base import TCPROSTransport
from rospy.impl.tcpros_pubsub import QueuedConnection
from rospy.impl.tcpros_service import ServiceImpl


def greet_clients_apart() -> None:
    """Has each new connection's header read in a thread of its own; for an initialised node.

    rospy reads it in the thread that accepts connections. A client that connects and is then stopped, or
    hangs, keeps everybody else out of all the node's services and topics for as long as it lives.
    """
    server = rospy.impl.tcpros_base._tcpros_server.tcp_ros_server
    handle = server.inbound_handler

    def greet(client: socket.socket, address: tuple[str, int]) -> None:
        threading.Thread(
            target=handle, args=(client, address), name="greeting", daemon=True
        ).start()

    server.inbound_handler = greet


def hang_up_on_nonsense() -> None:
    """Closes the connection after a request that can't be read; before the node offers services.

    rospy's thread for the connection ends with a traceback, and leaves it open: the client waits for ever.
    """
    handle = ServiceImpl.handle

    def guarded(service: ServiceImpl, transport: TCPROSTransport, header: dict[str, str]) -> None:
        try:
            handle(service, transport, header)
        except TransportException as error:
            rospy.logwarn("A request to %s can't be read: %s", service.resolved_name, error)
        finally:
            transport.close()

    ServiceImpl.handle = guarded


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


def wait_until_sent(publisher: rospy.Publisher, bound: float = 1.0) -> None:
    """Waits until rospy's threads have written what was published, so that closing the topic loses nothing.

    Args:
        bound: of the wait [s of wall time]; a client that doesn't read holds nobody up for longer.
    """
    deadline = time.monotonic() + bound
    for connection in list(publisher.impl.connections):
        while not _has_sent(connection) and time.monotonic() < deadline:
            time.sleep(0.002)


def _has_sent(connection: Any) -> bool:
    """Whether the connection's thread waits for something to write."""
    if not isinstance(connection, QueuedConnection):
        return True
    with connection._lock:
        waits = bool(connection._cond_data_available._waiters)  # else it is still writing
        return bool(connection.done) or (waits and not connection._queue)
