"""What a topic's connections do with messages; see the package's docstring.

- `free_polls_at_once`: file descriptors of topics that are gone pile up (test_topics.py)
- `wait_until_sent`: what was published just before a topic is closed is thrown away (test_topics.py)
- `divert_messages`, `divert_connections`, `deliver`, `is_connected`: messages of a node in lock-step go with
  its calls (scripts.test)
- `publish_without_yielding`: a step in lock-step spends most of its time on it (test_mailboxes.py)
- `on_topics_changed`: and it has to know when there are others (scripts.test)
"""

import select
import time
import types
from collections.abc import Callable
from functools import partial
from typing import Any

import rospy
import rospy.impl.registration
from rospy.impl import tcpros_pubsub
from rospy.impl.tcpros_pubsub import QueuedConnection
from rospy.topics import Poller, _PublisherImpl, _SubscriberImpl, _TopicImpl


def free_polls_at_once() -> None:
    """Has what a topic polls its connections with closed together with the topic.

    rospy's refers to itself, so its file descriptor stays until some later collection of garbage: robots with
    controllers that come and go leave dozens.
    """

    def make(poller: Poller) -> None:
        poller.poller = select.epoll()

    Poller.__init__ = make
    Poller.add_fd, Poller.remove_fd = Poller.add_epoll, Poller.remove_epoll
    Poller.error_iter = Poller.error_epoll_iter


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


Sink = Callable[[str, bytes], None]
"""Takes a topic and a message as it goes over the wire, its length in front."""


def divert_messages(sink_of: Callable[[str], Sink | None]) -> None:
    """Gives what is published for some nodes to a sink instead of to their connections, once for a process.

    Args:
        sink_of: the sink of a node by name, or None where its messages are sent as ever; asked for each
            new connection. For those that exist already there is `divert_connections`.
    """
    add_connection = _TopicImpl.add_connection

    def diverting(topic: _TopicImpl, connection: Any) -> bool:
        if isinstance(topic, _PublisherImpl):
            sink = sink_of(connection.endpoint_id)
            if sink is not None:
                connection.write_data = partial(sink, topic.resolved_name)
        return bool(add_connection(topic, connection))

    _TopicImpl.add_connection = diverting


def publish_without_yielding() -> None:
    """Has who publishes go on at once: rospy gives the processor away after each message to each connection.

    For a world that only moves at a request: between two requests the threads that send have their turn.
    """
    module = types.ModuleType("time")
    vars(module).update(vars(time), sleep=_sleep_unless_zero)
    tcpros_pubsub.time = module


def _sleep_unless_zero(seconds: float) -> None:
    if seconds > 0:
        time.sleep(seconds)


def divert_connections(node: str, sink: Sink) -> None:
    """As `divert_messages`, for the connections that a node has already."""
    for topic in list(_topics().pubs.values()):
        for connection in list(topic.connections):
            if connection.endpoint_id == node:
                connection.write_data = partial(sink, topic.resolved_name)


def deliver(topic: str, data: bytes, node: str) -> None:
    """Hands a message of a node to this process's subscribers, in this thread; without any, to nobody.

    Raises:
        genpy.DeserializationError: if it can't be read.
    """
    subscription: _SubscriberImpl | None = _topics().get_subscriber_impl(topic)
    if subscription is None:
        return
    connections = [each for each in subscription.connections if each.callerid_pub == node]
    if connections:  # without a connection a message would have got lost, too
        message = subscription.data_class().deserialize(data[4:])
        message._connection_header = connections[-1].header
        subscription.receive_callback([message], connections[-1])


def is_connected(topic: str, node: str, publishes: bool) -> bool | None:
    """Whether a node is connected to a topic; None if this process has no such topic.

    Args:
        publishes: this process does, and the node subscribes; else the other way round.
    """
    if publishes:
        publication = _topics().get_publisher_impl(topic)
        return publication and any(each.endpoint_id == node for each in publication.connections)
    subscription = _topics().get_subscriber_impl(topic)
    return subscription and any(each.callerid_pub == node for each in subscription.connections)


def on_topics_changed(call: Callable[[], None]) -> None:
    """Has a function called when this process publishes or subscribes to a topic more, or less."""

    class Listener(rospy.impl.registration.RegistrationListener):
        def reg_added(self, _name: str, _kind: str, _way: str) -> None:
            call()

        reg_removed = reg_added

    rospy.impl.registration.get_registration_listeners().add_listener(Listener())


def _topics() -> Any:
    return rospy.impl.registration.get_topic_manager()
