"""What is published just before a topic is closed is sent; a topic that is gone leaves no file open."""

from __future__ import annotations

import gc
import os
import socket
import threading
import time
from collections.abc import Iterator
from types import SimpleNamespace

import pytest
import rospy.topics
from rospy.impl.registration import Registration, RegManager
from rospy.impl.tcpros_pubsub import QueuedConnection
from rospy.topics import _PublisherImpl, _TopicImpl
from std_msgs.msg import String

from bullet_gazebo.common import rospy_internals
from bullet_gazebo.common.rospy_internals import free_polls_at_once, registered_together, wait_until_sent


class SlowTransport:
    """Writes only when it may."""

    def __init__(self) -> None:
        self.done = False
        self.written: list[bytes] = []
        self.may_write = threading.Event()
        self._closed = lambda connection: None

    def set_cleanup_callback(self, callback) -> None:
        self._closed = callback

    def write_data(self, data: bytes) -> None:
        self.may_write.wait(10)
        self.written.append(data)

    def close(self) -> None:
        self.done = True
        self._closed(self)


def publisher(*transports: SlowTransport) -> SimpleNamespace:
    connections = [QueuedConnection(transport, 10) for transport in transports]
    return SimpleNamespace(impl=SimpleNamespace(connections=connections))


def test_it_waits_until_all_is_written() -> None:
    slow, quick = SlowTransport(), SlowTransport()
    quick.may_write.set()
    topic = publisher(slow, quick)
    for connection in topic.impl.connections:
        connection.write_data(b"result")
    threading.Timer(0.2, slow.may_write.set).start()
    wait_until_sent(topic, bound=10)
    assert slow.written == quick.written == [b"result"]
    for transport in (slow, quick):
        transport.close()


def test_a_client_that_does_not_read_holds_nobody_up() -> None:
    stuck = SlowTransport()
    topic = publisher(stuck)
    topic.impl.connections[0].write_data(b"result")
    began = time.monotonic()
    wait_until_sent(topic, bound=0.1)
    assert not stuck.written and time.monotonic() - began >= 0.1
    stuck.may_write.set()
    stuck.close()


@pytest.fixture
def no_collection() -> Iterator[None]:
    """What refers to itself stays, as it may for long."""
    gc.disable()
    yield
    gc.enable()


@pytest.mark.usefixtures("no_collection")
def test_a_topic_that_is_gone_leaves_no_file_open(monkeypatch) -> None:
    class Poller(rospy.topics.Poller):
        """One of its own, to be changed."""

    monkeypatch.setattr("bullet_gazebo.common.rospy_internals.Poller", Poller)
    free_polls_at_once()
    before = os.listdir("/proc/self/fd")
    for _ in range(20):
        poller = Poller()
    one, other = socket.socketpair()
    with one:
        poller.add_fd(one.fileno())
        assert list(poller.error_iter()) == []
        other.close()
        assert list(poller.error_iter()) == [one.fileno()]
        poller.remove_fd(one.fileno())
        assert list(poller.error_iter()) == []
    del poller
    assert len(os.listdir("/proc/self/fd")) == len(before)


def test_services_are_registered_together(master) -> None:
    """Else a client finds some of them, and calls one that isn't there yet."""
    manager = SimpleNamespace(uri="http://127.0.0.1:1", master_uri=master.uri)
    names = ["/gazebo/spawn_sdf_model", "/gazebo/pause_physics"]
    with registered_together():
        for name in names:
            RegManager.reg_added(manager, name, "rosrpc://127.0.0.1:1", Registration.SRV)
            assert not master.services
    assert list(master.services) == names


@pytest.fixture
def _put_back(monkeypatch) -> None:
    for kind in (_TopicImpl, _PublisherImpl):
        monkeypatch.setattr(kind, "add_connection", kind.add_connection)


def connection() -> SimpleNamespace:
    """That of a script."""
    return SimpleNamespace(
        endpoint_id="/script", cleanup_cb=None, fileno=lambda: None, set_cleanup_callback=print
    )


@pytest.mark.usefixtures("_put_back")
def test_a_connection_that_comes_while_its_node_does_is_diverted() -> None:
    """The node comes right after the connection has been looked at, and before the topic has it."""
    got: list[object] = []
    sinks = iter([None, lambda *message: got.append(message)])
    rospy_internals.divert_messages(lambda node: next(sinks))
    node = connection()
    _PublisherImpl("/scan", String).add_connection(node)
    node.write_data(b"1")
    assert got == [("/scan", b"1")]


@pytest.mark.usefixtures("_put_back")
def test_a_node_is_connected_once_the_topic_s_listeners_know_of_it(monkeypatch) -> None:
    """Else what a sensor measures for it comes before or after the messages of the same request."""
    rospy_internals.divert_messages(lambda node: None)
    topic, seen = _PublisherImpl("/scan", String), []
    topics = SimpleNamespace(get_publisher_impl=lambda name: topic)
    monkeypatch.setattr(rospy_internals, "_topics", lambda: topics)

    def is_connected() -> bool | None:
        return rospy_internals.is_connected("/scan", "/script", publishes=True)

    listener = SimpleNamespace(peer_subscribe=lambda *_: seen.append(is_connected()))
    topic.add_subscriber_listener(listener)
    node = connection()
    seen.append(is_connected())
    topic.add_connection(node)
    assert [*seen, is_connected()] == [False, False, True]
