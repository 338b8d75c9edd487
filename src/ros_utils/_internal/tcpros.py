"""Service calls over ROS's TCP protocol, each with a time limit, under any master.

rospy's proxies have no time limit, keep a dead connection, and ask the process's own master even if they
know the address.
"""

from __future__ import annotations

import io
import socket
import struct
from typing import Any

import genpy
import rosgraph
import rospy

from ros_utils._internal import master as _master

CHUNK = 65536  # [bytes]
HEAD = struct.Struct("<BI")  # of an answer: whether the call succeeded, and its length
LENGTH = struct.Struct("<I")


class CallFailed(Exception):
    """The call failed; the text says why."""


class ConnectionEnded(CallFailed):
    """The connection broke: the other side has ended."""


class Connection:
    """A lasting connection to one service. Not thread-safe."""

    def __init__(self, address: str, name: str, kind: Any, timeout: float) -> None:
        """Connects to the service at a ``rosrpc://`` address; no wait is longer than `timeout` [s].

        Raises:
            CallFailed: no connection, or another type of service.
            TimeoutError: no answer in time.
        """
        self._kind = kind
        self._timeout = 0.0  # [s] of the blocking socket; not set yet
        try:
            host, port = rospy.core.parse_rosrpc_uri(address)
            self._socket = socket.create_connection((host, port), timeout)
            try:
                self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                self._shake_hands(name)
            except BaseException:
                self._socket.close()
                raise
        except TimeoutError:
            raise
        except (OSError, rosgraph.network.ROSHandshakeException, rospy.ROSException) as fault:
            raise ConnectionEnded(str(fault)) from fault

    def _shake_hands(self, name: str) -> None:
        header = {
            "callerid": rospy.get_caller_id() or _master.CALLER,
            "service": name,
            "md5sum": self._kind._md5sum,
            "type": self._kind._type,
            "persistent": "1",
        }
        rosgraph.network.write_ros_handshake_header(self._socket, header)
        answer = rosgraph.network.read_ros_handshake_header(self._socket, io.BytesIO(), CHUNK)
        if "error" in answer:
            raise CallFailed(answer["error"])

    def call(self, message: genpy.Message, timeout: float) -> Any:
        """Sends a request and returns the response; no wait is longer than `timeout` [s].

        Raises:
            CallFailed: the service failed; ConnectionEnded: there is no connection any more.
            TimeoutError: no answer in time; the connection is of no use afterwards.
        """
        payload = _serialized(message)
        try:
            if timeout != self._timeout:
                self._set_timeout(timeout)
            self._socket.sendall(payload)
            ok, answer = self._receive()
        except BlockingIOError as fault:
            raise TimeoutError from fault
        except OSError as fault:
            raise ConnectionEnded(str(fault)) from fault
        if not ok:
            reason = answer.decode(errors="replace") or "without a reason"
            raise CallFailed(f"it failed: {reason}")
        response = self._kind._response_class()
        try:
            response.deserialize(answer)
        except genpy.DeserializationError as fault:
            raise CallFailed(f"its answer can't be read: {fault}") from fault
        return response

    def _set_timeout(self, timeout: float) -> None:
        """Lets the kernel see to the time limit: Python's own costs a system call more for each wait."""
        limit = struct.pack("@ll", int(timeout), int(timeout % 1.0 * 1e6))
        self._socket.settimeout(None)
        for option in (socket.SO_RCVTIMEO, socket.SO_SNDTIMEO):
            self._socket.setsockopt(socket.SOL_SOCKET, option, limit)
        self._timeout = timeout

    def _receive(self) -> tuple[bool, bytes]:
        """Reads one answer; most come in one piece."""
        data = self._more()
        while len(data) < HEAD.size:
            data += self._more()
        ok, length = HEAD.unpack_from(data)
        if len(data) == HEAD.size + length:
            return bool(ok), data[HEAD.size :]
        whole = bytearray(data)
        while len(whole) < HEAD.size + length:
            whole += self._more()
        return bool(ok), bytes(whole[HEAD.size :])

    def _more(self) -> bytes:
        part = self._socket.recv(CHUNK)
        if not part:
            raise ConnectionError("the connection ended before the answer")
        return part

    def close(self) -> None:
        """Ends the connection."""
        self._socket.close()


def call(address: str, name: str, kind: Any, request: tuple[Any, ...], timeout: float) -> Any:
    """Call the service at a ``rosrpc://`` address and return its response.

    Raises:
        CallFailed: no connection, another type of service, or the service failed.
        TimeoutError: an answer didn't come within `timeout` [s].
    """
    message = request_message(kind, request)
    connection = Connection(address, name, kind, timeout)
    try:
        return connection.call(message, timeout)
    finally:
        connection.close()


def request_message(kind: Any, request: tuple[Any, ...]) -> genpy.Message:
    """The request, given as such or by its fields in order.

    Raises:
        CallFailed: if the fields are not the request's.
    """
    try:
        return rospy.msg.args_kwds_to_message(kind._request_class, request, {})
    except TypeError as fault:
        raise CallFailed(f"the request can't be sent: {fault}") from fault


def _serialized(message: genpy.Message) -> bytes:
    """The request with its length in front."""
    buffer = io.BytesIO()
    buffer.write(LENGTH.pack(0))
    try:
        message.serialize(buffer)
    except (TypeError, genpy.SerializationError, struct.error) as fault:
        raise CallFailed(f"the request can't be sent: {fault}") from fault
    buffer.getbuffer()[: LENGTH.size] = LENGTH.pack(buffer.tell() - LENGTH.size)
    return buffer.getvalue()
