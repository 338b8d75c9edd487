"""Patches of rospy's topics, time, XML-RPC server, and registration at the master.

- `free_polls_at_once`: file descriptors of closed topics pile up (test_rospy_internals.py)
- `wait_until_sent`: a message published just before its topic closes is lost (test_rospy_internals.py)
- `divert_messages`, `divert_connections`, `deliver`, `is_connected`, `on_topics_changed`: the messages of a
  node in lock-step go with its calls (scripts.test)
- `publish_without_yielding`: a step in lock-step would spend most of its time there (test_advance_service.py)
- `answer_xmlrpc`: rospy has no way to answer one more XML-RPC call (gazebo_ros.test, `gz`)
- `stop_hearing_clock`, `set_time`: the node that publishes /clock would hear it over a socket to itself
  (gazebo_parameters.test, gazebo_ros.test)
- `registered_together`: clients find some services before the others (test_rospy_internals.py)
"""

import contextlib
import select
import time
import types
import xmlrpc.client
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any

import genpy
import rospy
import rospy.impl.registration
import rospy.impl.simtime
from rospy.impl import tcpros_pubsub
from rospy.impl.masterslave import ROSHandler
from rospy.impl.registration import Registration, RegManager
from rospy.impl.tcpros_pubsub import QueuedConnection
from rospy.topics import Poller, _PublisherImpl, _SubscriberImpl, _TopicImpl

from ros_calls import master

Sink = Callable[[str, bytes], None]
"""Takes a topic and a message as it goes over the wire, its length in front."""


def free_polls_at_once() -> None:
    """Closes a topic's poller together with the topic.

    rospy's poller refers to itself, so its file descriptor stays until some later garbage collection: robots
    with controllers that come and go leave dozens.
    """

    def make(poller: Poller) -> None:
        poller.poller = select.epoll()

    Poller.__init__ = make
    Poller.add_fd, Poller.remove_fd = Poller.add_epoll, Poller.remove_epoll
    Poller.error_iter = Poller.error_epoll_iter


def wait_until_sent(publisher: rospy.Publisher, bound: float = 1.0) -> None:
    """Waits until rospy's threads have written all messages, so that closing the topic loses none.

    A client that doesn't read is waited for until `bound` [s of wall time].
    """
    deadline = time.monotonic() + bound
    for connection in list(publisher.impl.connections):
        while not _has_sent(connection) and time.monotonic() < deadline:
            time.sleep(0.002)


def _has_sent(connection: Any) -> bool:
    """Returns whether the connection's thread waits for a message to write."""
    if not isinstance(connection, QueuedConnection):
        return True
    with connection._lock:
        waits = bool(connection._cond_data_available._waiters)  # else it is still writing
        return bool(connection.done) or (waits and not connection._queue)


def divert_messages(sink_of: Callable[[str], Sink | None]) -> None:
    """Passes messages for some nodes to a sink instead of their connections; once for a process.

    A connection counts as connected once the topic's listeners know of it (`is_connected`). `sink_of` returns
    the sink of a node, or None, for each new connection; `divert_connections` is for the existing ones.
    """
    add_connection = _TopicImpl.add_connection

    def divert(topic: _TopicImpl, connection: Any) -> None:
        sink = sink_of(connection.endpoint_id) if isinstance(topic, _PublisherImpl) else None
        if sink is not None:
            connection.write_data = partial(sink, topic.resolved_name)

    def diverting(topic: _TopicImpl, connection: Any) -> bool:
        divert(topic, connection)
        added = bool(add_connection(topic, connection))
        divert(topic, connection)  # the sink may have come meanwhile: see `divert_connections`
        return added

    add = _PublisherImpl.add_connection

    def adding(topic: _PublisherImpl, connection: Any) -> bool:
        connection.is_being_added = True
        added = bool(add(topic, connection))
        connection.is_being_added = False
        return added

    _TopicImpl.add_connection = diverting
    _PublisherImpl.add_connection = adding


def publish_without_yielding() -> None:
    """Lets a publisher continue at once: rospy yields the processor after each message to each connection.

    For a world that moves only at a request: the threads that send run between two requests.
    """

    def sleep(seconds: float) -> None:
        if seconds > 0:
            time.sleep(seconds)

    module = types.ModuleType("time")
    vars(module).update(vars(time), sleep=sleep)
    tcpros_pubsub.time = module


def divert_connections(node: str, sink: Sink) -> None:
    """Does the same as `divert_messages` for the connections that a node has already."""
    for topic in list(_topics().pubs.values()):
        for connection in list(topic.connections):
            if connection.endpoint_id == node:
                connection.write_data = partial(sink, topic.resolved_name)


def deliver(topic: str, data: bytes, node: str) -> None:
    """Passes a message of a node to this process's subscribers, if there are any, in this thread.

    Raises genpy.DeserializationError if it can't be read.
    """
    subscription: _SubscriberImpl | None = _topics().get_subscriber_impl(topic)
    if subscription is None:
        return
    connections = [each for each in subscription.connections if each.callerid_pub == node]
    if connections:  # without a connection rospy would have lost the message, too
        message = subscription.data_class().deserialize(data[4:])
        message._connection_header = connections[-1].header
        subscription.receive_callback([message], connections[-1])


def is_connected(topic: str, node: str, publishes: bool) -> bool | None:
    """Returns whether a node is connected to a topic that this process `publishes`, or subscribes to.

    None if it doesn't have the topic.
    """
    if publishes:
        publication = _topics().get_publisher_impl(topic)
        return publication and any(
            each.endpoint_id == node and not getattr(each, "is_being_added", False)
            for each in publication.connections
        )
    subscription = _topics().get_subscriber_impl(topic)
    return subscription and any(each.callerid_pub == node for each in subscription.connections)


def subscribers(topic: str) -> list[str]:
    """Returns the nodes that subscribe to a topic of this process, given its resolved name."""
    return [each.endpoint_id for each in connections(topic)]


def connections(topic: str) -> Sequence[Any]:
    """Returns the connections to the subscribers of a topic: another list when one comes or goes."""
    publication = _topics().get_publisher_impl(topic)
    return publication.connections if publication else ()


def on_topics_changed(call: Callable[[], None]) -> None:
    """Calls a function when this process begins or ends to publish or subscribe to a topic."""

    class Listener(rospy.impl.registration.RegistrationListener):
        def reg_added(self, _name: str, _kind: str, _way: str) -> None:
            call()

        reg_removed = reg_added

    rospy.impl.registration.get_registration_listeners().add_listener(Listener())


def _topics() -> Any:
    return rospy.impl.registration.get_topic_manager()


def answer_xmlrpc(method: str, answer: Callable[..., tuple[int, str, Any]]) -> None:
    """Makes this process's node answer one XML-RPC call more, by code (1 is success), text and value.

    `answer` is called with the arguments behind the caller's name, of any number and type.
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


@contextlib.contextmanager
def registered_together() -> Iterator[None]:
    """Registers the services that a block offers at its end, in one call of the master.

    So a client that finds one of them finds the others. Raises OSError if the master doesn't answer.
    """
    proxy = rospy.core.xmlrpcapi(master.uri())
    calls, reg_added = xmlrpc.client.MultiCall(proxy), RegManager.reg_added

    def add(manager: RegManager, name: str, what: str, kind: str) -> None:
        if kind == Registration.SRV:
            calls.registerService(rospy.get_name(), name, what, manager.uri)
        else:
            reg_added(manager, name, what, kind)

    RegManager.reg_added = add
    try:
        yield
    finally:
        RegManager.reg_added = reg_added
    answers: Any = calls()
    for code, text, _ in answers:
        if code != 1:
            rospy.logfatal("unable to register a service with the master: %s", text)
