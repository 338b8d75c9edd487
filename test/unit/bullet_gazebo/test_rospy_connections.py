"""Clients that send nonsense, too much or nothing: what they can make the node keep has a bound."""

from __future__ import annotations

import contextlib
import io
import socket
import struct
import threading
from collections.abc import Iterator

import pytest
import rospy
import rospy.impl.tcpros_base
from rosgraph.network import ROSHandshakeException, encode_ros_handshake_header
from rospy.exceptions import TransportTerminated
from rospy.impl.tcpros_base import TCPROSTransportProtocol, TCPServer
from std_msgs.msg import String

from bullet_gazebo.common import rospy_connections as connections
from bullet_gazebo.common.rospy_connections import LARGEST_HEADER, LARGEST_MESSAGE, Reception, bound_messages

BOUND = 60.0  # [s]
LOOPBACK = "127.0.0.1"
HELLO = encode_ros_handshake_header({"callerid": "/test", "service": "/any"})


@pytest.fixture(autouse=True)
def told(monkeypatch) -> list[str]:
    """Warnings; and whatever is patched here is undone."""
    texts: list[str] = []
    monkeypatch.setattr(rospy, "logwarn_throttle", lambda period, text: texts.append(text))
    monkeypatch.setattr(rospy.impl.tcpros_base, "read_ros_handshake_header", None)
    read = TCPROSTransportProtocol.read_messages
    monkeypatch.setattr(TCPROSTransportProtocol, "read_messages", read)
    return texts


class Server:
    """Receives connections as a node does, and answers a header by its service's name."""

    def __init__(self) -> None:
        bound_messages()
        self._tcp = TCPServer(Reception(self._handle).greet)
        self._tcp.server_sock = connections._Listener(self._tcp.server_sock)
        self._tcp.start()

    def _handle(self, client: socket.socket, address: tuple[str, int]) -> None:
        with client, contextlib.suppress(OSError, ROSHandshakeException, KeyError):
            header = rospy.impl.tcpros_base.read_ros_handshake_header(client, io.BytesIO(), 4096)
            client.sendall(header["service"].encode())

    def connect(self) -> socket.socket:
        return socket.create_connection((LOOPBACK, self._tcp.port), BOUND)

    def greet(self) -> bytes:
        with self.connect() as client:
            client.sendall(HELLO)
            return client.recv(100)

    def close(self) -> None:
        self._tcp.is_shutdown = True
        with contextlib.suppress(OSError):
            self.connect().close()  # wakes it
        self._tcp.server_sock.close()


@pytest.fixture
def server(monkeypatch) -> Iterator[Server]:
    monkeypatch.setenv("ROS_IP", LOOPBACK)
    made = Server()
    yield made
    made.close()


def ends(client: socket.socket) -> bool:
    """Whether the other side ends the connection."""
    with client:
        try:
            return client.recv(1) == b""
        except ConnectionError:
            return True


def test_a_header_in_pieces_is_read(server) -> None:
    with server.connect() as client:
        for byte in HELLO:
            client.sendall(bytes([byte]))
        assert client.recv(100) == b"/any"
    assert server.greet() == b"/any"


@pytest.mark.parametrize("size", [LARGEST_HEADER + 1, 2**31 - 1, 2**32 - 1])
def test_a_header_that_claims_to_be_long_is_not_waited_for(server, size) -> None:
    client = server.connect()
    client.sendall(struct.pack("<I", size) + b"x" * 100)
    assert ends(client)
    assert server.greet() == b"/any"


@pytest.mark.parametrize(
    "garbage", [b"", b"\x01", b"\0\0\0\0", b"\x05\0\0\0abc", b"\x08\0\0\0\xff\xff\xff\xff1234"]
)
def test_garbage_ends_its_own_connection_only(server, garbage) -> None:
    client = server.connect()
    client.sendall(garbage)
    client.shutdown(socket.SHUT_WR)
    assert ends(client)
    assert server.greet() == b"/any"


def test_a_client_that_says_nothing_for_long_is_let_go(server, monkeypatch) -> None:
    monkeypatch.setattr(connections, "SILENCE", 0.05)
    client = server.connect()
    client.sendall(b"\x10")
    assert ends(client)


def test_without_a_thread_for_it_a_client_is_turned_away(server, monkeypatch, told) -> None:
    start = threading.Thread.start

    def fail(thread: threading.Thread) -> None:
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr(threading.Thread, "start", fail)
    assert ends(server.connect())
    monkeypatch.setattr(threading.Thread, "start", start)
    assert server.greet() == b"/any"
    assert "can't start new thread" in told[0]


def test_the_loop_outlives_a_lack_of_descriptors() -> None:
    class Exhausted:
        tries = 0

        def listen(self, most: int) -> None: ...

        def accept(self) -> object:
            self.tries += 1
            if self.tries < 3:
                raise OSError(24, "Too many open files")
            return "a client"

        def close(self) -> None: ...

    listener = connections._Listener(Exhausted())
    for _ in range(2):
        with pytest.raises(TimeoutError):
            listener.accept()
    assert listener.accept() == "a client"


@pytest.mark.parametrize("size", [LARGEST_MESSAGE + 1, 2**32 - 1])
def test_a_message_that_claims_to_be_large_ends_its_connection(told, size) -> None:
    bound_messages()
    protocol = TCPROSTransportProtocol("/any", String)
    buffer = io.BytesIO()
    buffer.write(struct.pack("<I", size) + b"x")
    with pytest.raises(TransportTerminated):
        protocol.read_messages(buffer, [], None)
    assert "/any" in told[0]
