"""Patches of rospy against clients that send nothing, too much or nonsense.

- `Reception`: a client that sends nothing keeps all others out, a lack of file descriptors ends the thread
  that accepts connections (gazebo_clients.test, test_rospy_connections.py)
- `bound_messages`: rospy reads whatever size a client claims into memory (test_rospy_connections.py)
- `hang_up_on_nonsense`: a client whose request can't be read waits forever (gazebo_clients.test)
"""

import errno
import io
import socket
import struct
import threading
import time
from collections.abc import Callable
from typing import Any

import rospy
import rospy.impl.tcpros_base
from rosgraph.network import ROSHandshakeException, decode_ros_handshake_header
from rosgraph.xmlrpc import SilenceableXMLRPCRequestHandler
from rospy.exceptions import TransportException, TransportTerminated
from rospy.impl.tcpros_base import TCPROSTransport, TCPROSTransportProtocol
from rospy.impl.tcpros_service import ServiceImpl

Address = tuple[str, int]
LENGTH = struct.Struct("<I")  # in front of everything that ROS sends
LARGEST_HEADER = 2**18  # [bytes]; the text of a message's definition is the longest part
# Of a request or a topic's message [bytes]. A model's text that is too long to be parsed fits in, so that its
# sender gets an answer instead of a closed connection.
LARGEST_MESSAGE = 2**27
SILENCE = 30.0  # [s] that a client may be silent in the middle of a header
IDLE = 300.0  # [s] the same in an XML-RPC call and between two: clients keep connections, and renew them
BACKLOG = 64  # connections that wait; rospy lets five do so, and others retry after seconds
EXHAUSTED = (errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM)
RECOVERY = 0.1  # [s] until the next try
REPEAT = 1.0  # [s] between two logs of the same complaint


class Reception:
    """Reads each new connection's header in a thread of its own, within SILENCE; for an initialised node.

    rospy reads it in the thread that accepts connections. A client that connects and then hangs keeps
    everybody else out of all services and topics of the node.
    """

    def __init__(self, handle: Callable[[socket.socket, Address], None]) -> None:
        """`handle` reads the header and passes the connection to a topic or service."""
        self._handle = handle

    @classmethod
    def open(cls) -> None:
        """Takes over the connections of this process's node."""
        server = rospy.impl.tcpros_base._tcpros_server.tcp_ros_server
        server.inbound_handler = cls(server.inbound_handler).greet
        server.server_sock = _Listener(server.server_sock)
        SilenceableXMLRPCRequestHandler.timeout = IDLE

    def greet(self, client: socket.socket, address: Address) -> None:
        """Takes a new connection, and returns at once."""
        client.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)  # its machine may go
        client.settimeout(SILENCE)  # rospy resets it after the header
        try:
            threading.Thread(target=self._handle, args=(client, address), daemon=True).start()
        except RuntimeError as error:  # no thread is left
            client.close()
            rospy.logwarn_throttle(REPEAT, f"{error}; a client of {address[0]} is turned away")


class _Listener:
    """The listening socket for rospy's loop, which ends at any error but a timeout."""

    def __init__(self, listener: socket.socket) -> None:
        self._listener = listener
        self.close = listener.close
        listener.listen(BACKLOG)

    def accept(self) -> tuple[socket.socket, Address]:
        try:
            return self._listener.accept()
        except OSError as error:
            if error.errno not in EXHAUSTED:
                raise
            time.sleep(RECOVERY)
            raise TimeoutError(str(error)) from error


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
