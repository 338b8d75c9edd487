"""Clients that send nonsense, too much or nothing: what they can make the node keep has a bound."""

from __future__ import annotations

import contextlib
import io
import resource
import socket
import struct
import threading
import xmlrpc.client
from collections.abc import Iterator

import pytest
import rospy
import rospy.impl.tcpros_base
from rosgraph.network import ROSHandshakeException, encode_ros_handshake_header
from rosgraph.xmlrpc import SilenceableXMLRPCRequestHandler, ThreadingXMLRPCServer
from rospy.exceptions import TransportTerminated
from rospy.impl.tcpros_base import TCPROSTransportProtocol, TCPServer
from std_msgs.msg import String

from bullet_gazebo.common import rospy_connections as connections
from bullet_gazebo.common.rospy_connections import (
    LARGEST_CALL,
    LARGEST_HEADER,
    LARGEST_MESSAGE,
    Reception,
    bound_calls,
    bound_messages,
)

BOUND = 60.0  # [s]
LOOPBACK = "127.0.0.1"
HELLO = encode_ros_handshake_header({"callerid": "/test", "service": "/any"})


@pytest.fixture(autouse=True)
def told(monkeypatch) -> list[str]:
    """Warnings; and whatever is patched here is undone."""
    texts: list[str] = []
    monkeypatch.setattr(rospy, "logwarn_throttle", lambda period, text: texts.append(text))
    monkeypatch.setattr(rospy.impl.tcpros_base, "read_ros_handshake_header", None)
    read, handler = TCPROSTransportProtocol.read_messages, SilenceableXMLRPCRequestHandler
    monkeypatch.setattr(TCPROSTransportProtocol, "read_messages", read)
    monkeypatch.setattr(handler, "do_POST", handler.do_POST)
    monkeypatch.setattr(handler, "timeout", None)
    monkeypatch.setattr(
        ThreadingXMLRPCServer, "verify_request", lambda server, request, address: True
    )
    return texts


class Server:
    """Receives connections as a node does, and answers a header by its service's name."""

    def __init__(self) -> None:
        bound_messages()
        self._tcp = TCPServer(Reception(self._handle).greet)
        self._tcp.server_sock = connections._Listener(self._tcp.server_sock)
        self._tcp.start()
        self.handled = self.met = 0

    def _handle(self, client: socket.socket, address: tuple[str, int]) -> None:
        self.met += 1
        with client, contextlib.suppress(OSError, ROSHandshakeException, KeyError):
            header = rospy.impl.tcpros_base.read_ros_handshake_header(client, io.BytesIO(), 4096)
            client.sendall(header["service"].encode())
            self.handled += 1

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
    # Who only looks whether anybody listens is no fault: rospy's handler would log a warning.
    assert server.met == 1 + bool(garbage)


def test_silent_clients_push_each_other_out_and_nobody_else(server, monkeypatch) -> None:
    monkeypatch.setattr(connections, "MOST_STRANGERS", 5)
    monkeypatch.setattr(connections, "SILENCE", 2 * BOUND)  # nobody ends by himself
    silent = [server.connect() for _ in range(20)]
    assert server.greet() == b"/any"
    assert all(ends(client) for client in silent[:15])
    for client in silent:
        client.close()


def test_a_client_that_says_nothing_for_long_is_let_go(server, monkeypatch) -> None:
    monkeypatch.setattr(connections, "SILENCE", 0.05)
    client = server.connect()
    client.sendall(b"\x10")
    assert ends(client)


def test_without_a_thread_for_it_a_client_is_turned_away(server, monkeypatch, told) -> None:
    start = threading.Thread.start

    def fail(thread: threading.Thread) -> None:
        if thread.name == "greeting":
            raise RuntimeError("can't start new thread")
        start(thread)

    monkeypatch.setattr(threading.Thread, "start", fail)
    assert ends(server.connect())
    monkeypatch.setattr(threading.Thread, "start", start)
    assert server.greet() == b"/any"
    assert "can't start new thread" in told[0]


def test_where_few_descriptors_are_left_no_client_is_taken(server, monkeypatch, told) -> None:
    with monkeypatch.context() as few:
        few.setattr(resource, "getrlimit", lambda kind: (10, 10))
        assert ends(server.connect())
    assert server.greet() == b"/any"
    assert "file descriptors" in told[0]


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


@pytest.fixture
def calls() -> Iterator[tuple[str, int]]:
    """An XML-RPC server as a node's."""
    bound_calls()
    made = ThreadingXMLRPCServer((LOOPBACK, 0), log_requests=0)
    made.register_function(len, "len")
    thread = threading.Thread(target=made.serve_forever, args=(0.01,))
    thread.start()
    yield made.server_address
    made.shutdown()
    thread.join()
    made.server_close()


def call(address: tuple[str, int]) -> object:
    with xmlrpc.client.ServerProxy(f"http://{address[0]}:{address[1]}") as proxy:
        return proxy.len("four")


@pytest.mark.parametrize(
    "length", [str(LARGEST_CALL + 1), "-1", "1e3", "", "9" * 5000, "²", "+5", None]
)
def test_a_call_of_a_length_that_can_not_be_is_refused(calls, length) -> None:
    with socket.create_connection(calls, BOUND) as client:
        header = f"Content-Length: {length}\r\n" if length is not None else ""
        client.sendall(f"POST /RPC2 HTTP/1.1\r\nHost: x\r\n{header}\r\n".encode("latin-1"))
        assert client.recv(12) == b"HTTP/1.1 413"
    assert call(calls) == 4


def test_a_caller_that_says_nothing_is_let_go(calls, monkeypatch) -> None:
    monkeypatch.setattr(SilenceableXMLRPCRequestHandler, "timeout", 0.05)
    silent = socket.create_connection(calls, BOUND)
    silent.sendall(b"POST /RPC2 HTTP/1.1\r\n")
    assert ends(silent)
    assert call(calls) == 4


def test_where_few_descriptors_are_left_no_call_is_answered(calls, monkeypatch) -> None:
    monkeypatch.setattr(connections, "_crowded", lambda: True)
    assert ends(socket.create_connection(calls, BOUND))
    monkeypatch.setattr(connections, "_crowded", lambda: False)
    assert call(calls) == 4
