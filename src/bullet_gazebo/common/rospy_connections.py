"""Patches of rospy against clients that send nothing, too much or nonsense.

- `Reception`: a client that sends nothing keeps all others out; many of them, or a lack of file
  descriptors, end the thread that accepts connections (gazebo_clients.test, test_rospy_connections.py)
- `bound_messages`: rospy reads whatever size a client claims into memory (test_rospy_connections.py)
- `bound_calls`: so does its XML-RPC server, where silent clients keep a thread each forever (the same)
- `hang_up_on_nonsense`: a client whose request can't be read waits forever (gazebo_clients.test)
"""

import contextlib
import errno
import io
import os
import resource
import socket
import struct
import threading
import time
from collections.abc import Callable
from typing import Any

import rospy
import rospy.impl.tcpros_base
from rosgraph.network import ROSHandshakeException, decode_ros_handshake_header
from rosgraph.xmlrpc import SilenceableXMLRPCRequestHandler, ThreadingXMLRPCServer
from rospy.exceptions import TransportException, TransportTerminated
from rospy.impl.tcpros_base import TCPROSTransport, TCPROSTransportProtocol
from rospy.impl.tcpros_service import ServiceImpl

Address = tuple[str, int]
LENGTH = struct.Struct("<I")  # in front of everything that ROS sends
LARGEST_HEADER = 2**18  # [bytes]; the text of a message's definition is the longest part
# Of a request or a topic's message [bytes]. A model's text that is too long to be parsed fits in, so that its
# sender gets an answer instead of a closed connection.
LARGEST_MESSAGE = 2**27
LARGEST_CALL = 2**24  # [bytes] of an XML-RPC call
SILENCE = 30.0  # [s] that a client may be silent in the middle of a header
IDLE = 300.0  # [s] the same in an XML-RPC call and between two: clients keep connections, and renew them
MOST_STRANGERS = 64  # connections whose header hasn't come yet
EXHAUSTED = (errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM)
RECOVERY = 0.1  # [s] until the next try
REPEAT = 1.0  # [s] between two logs of the same complaint
CROWDED = "three quarters of this process's file descriptors are in use"


class Reception:
    """Reads each new connection's header in a thread of its own; for an initialised node.

    rospy reads it in the thread that accepts connections. A client that connects and then hangs keeps
    everybody else out of all services and topics of the node.

    At most MOST_STRANGERS connections wait for their header, for SILENCE each; another one pushes out the
    oldest. None is accepted where few file descriptors are left, because the node itself needs some.
    """

    def __init__(self, handle: Callable[[socket.socket, Address], None]) -> None:
        """`handle` reads the header and passes the connection to a topic or service."""
        self._handle = handle
        self._strangers: dict[socket.socket, None] = {}  # in the order in which they came
        self._guard = threading.Lock()

    @classmethod
    def open(cls) -> None:
        """Takes over the connections of this process's node."""
        server = rospy.impl.tcpros_base._tcpros_server.tcp_ros_server
        server.inbound_handler = cls(server.inbound_handler).greet
        server.server_sock = _Listener(server.server_sock)

    def greet(self, client: socket.socket, address: Address) -> None:
        """Takes a new connection, and returns at once."""
        if _crowded():
            self._turn_away(client, address, CROWDED)
            return
        with self._guard:
            self._strangers[client] = None
            if len(self._strangers) > MOST_STRANGERS:
                # Here, not when its thread ends: clients that come at once would push out the same one.
                oldest = next(iter(self._strangers))
                del self._strangers[oldest]
                with contextlib.suppress(OSError):  # it has gone already
                    oldest.shutdown(socket.SHUT_RDWR)
        listen = threading.Thread(
            target=self._listen, args=(client, address), name="greeting", daemon=True
        )
        try:
            listen.start()
        except RuntimeError as error:  # no thread is left
            self._turn_away(client, address, str(error))

    def _listen(self, client: socket.socket, address: Address) -> None:
        client.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)  # its machine may go
        client.settimeout(SILENCE)  # rospy resets it after the header
        try:
            if _says_nothing(client):  # it only looked whether anybody listens
                client.close()
            else:
                self._handle(client, address)
        finally:
            self._forget(client)

    def _turn_away(self, client: socket.socket, address: Address, reason: str) -> None:
        self._forget(client)
        client.close()
        rospy.logwarn_throttle(REPEAT, f"{reason}; a client of {address[0]} is turned away")

    def _forget(self, client: socket.socket) -> None:
        with self._guard:
            self._strangers.pop(client, None)


class _Listener:
    """The listening socket for rospy's loop, which ends at any error but a timeout."""

    def __init__(self, listener: socket.socket) -> None:
        self._listener = listener
        self.close = listener.close
        listener.listen(MOST_STRANGERS)  # rospy lets five wait; the others retry after seconds

    def accept(self) -> tuple[socket.socket, Address]:
        try:
            return self._listener.accept()
        except OSError as error:
            if error.errno not in EXHAUSTED:
                raise
            time.sleep(RECOVERY)
            raise TimeoutError(str(error)) from error


def _says_nothing(client: socket.socket) -> bool:
    """Returns whether a connection is closed before its first byte."""
    try:
        return not client.recv(1, socket.MSG_PEEK)
    except OSError:  # the handler will meet it, too
        return False


def _crowded() -> bool:
    """Returns whether three quarters of the file descriptors that this process may have are in use."""
    most, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    try:
        return len(os.listdir("/proc/self/fd")) > most * 3 // 4
    except OSError:  # none is left to open the folder with
        return True


def bound_messages() -> None:
    """Bounds the size of headers, requests and messages in this process.

    rospy reads as many bytes as the first four say, up to 4 GB, and copies a header as a whole with each part
    that comes.
    """
    read = TCPROSTransportProtocol.read_messages

    def read_messages(
        protocol: TCPROSTransportProtocol, buffer: io.BytesIO, queue: list[Any], sock: socket.socket
    ) -> None:
        (size,) = LENGTH.unpack(bytes(buffer.getbuffer()[: LENGTH.size]))
        if size > LARGEST_MESSAGE:
            what = f"{size} bytes for {protocol.resolved_name} are more than {LARGEST_MESSAGE}"
            rospy.logwarn_throttle(REPEAT, f"{what}: the connection is closed")
            raise TransportTerminated(what)
        read(protocol, buffer, queue, sock)

    TCPROSTransportProtocol.read_messages = read_messages
    rospy.impl.tcpros_base.read_ros_handshake_header = _read_header


def _read_header(sock: socket.socket, _buffer: io.BytesIO, _part: int) -> dict[str, str]:
    """Reads the header and nothing behind it, in place of rosgraph's function."""
    (size,) = LENGTH.unpack(_receive(sock, LENGTH.size))
    if size > LARGEST_HEADER:
        raise ROSHandshakeException(f"a header of {size} bytes is too long")
    header: dict[str, str] = decode_ros_handshake_header(LENGTH.pack(size) + _receive(sock, size))
    return header


def _receive(sock: socket.socket, size: int) -> bytes:
    whole = bytearray()
    while len(whole) < size:
        part = sock.recv(size - len(whole))
        if not part:
            raise ROSHandshakeException(f"the connection ended {len(whole)} bytes into a header")
        whole += part
    return bytes(whole)


def bound_calls() -> None:
    """Bounds size, silence and number of XML-RPC calls in this process."""
    post = SilenceableXMLRPCRequestHandler.do_POST

    def do_post(handler: SilenceableXMLRPCRequestHandler) -> None:
        size = handler.headers.get("content-length", "")
        if not (size.isascii() and size.isdigit() and len(size) < 12 and int(size) <= LARGEST_CALL):
            handler.close_connection = True
            handler.send_error(413, f"a call needs a length of at most {LARGEST_CALL} bytes")
            return
        post(handler)

    SilenceableXMLRPCRequestHandler.do_POST = do_post
    SilenceableXMLRPCRequestHandler.timeout = IDLE
    ThreadingXMLRPCServer.verify_request = lambda server, request, address: not _crowded()


def hang_up_on_nonsense() -> None:
    """Closes the connection after a request that can't be read; before the node offers services.

    rospy's thread of the connection ends with a traceback and leaves it open: the client waits forever.
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
