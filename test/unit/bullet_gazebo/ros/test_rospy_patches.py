"""What is published just before a topic is closed is sent."""

from __future__ import annotations

import threading
import time
from types import SimpleNamespace

from rospy.impl.tcpros_pubsub import QueuedConnection

from bullet_gazebo.ros.wire.rospy_patches import wait_until_sent


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


def test_without_clients_there_is_nothing_to_wait_for() -> None:
    wait_until_sent(publisher())
