"""One service call over ROS's TCP protocol, with a time limit, under any master.

rospy's proxies have no time limit, and ask the process's own master even if they know the address.
"""

from __future__ import annotations

import io
import socket
import struct
from typing import Any

import genpy
import rosgraph
import rospy

from ros_utils import _master


class CallFailed(Exception):
    """The call failed; the text says why."""


def call(address: str, name: str, kind: Any, request: tuple[Any, ...], timeout: float) -> Any:
    """Call the service at a ``rosrpc://`` address and return its response.

    Raises:
        CallFailed: no connection, another type of service, or the service failed.
        TimeoutError: an answer didn't come within `timeout` [s].
    """
    payload = _serialized(kind._request_class, request)
    try:
        host, port = rospy.core.parse_rosrpc_uri(address)
        with socket.create_connection((host, port), timeout) as connection:
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            _shake_hands(connection, name, kind)
            connection.sendall(payload)
            (ok,) = _read(connection, 1)
            (length,) = struct.unpack("<I", _read(connection, 4))
            answer = _read(connection, length)
    except TimeoutError:
        raise
    except (OSError, rosgraph.network.ROSHandshakeException, rospy.ROSException) as fault:
        raise CallFailed(str(fault)) from fault
    if not ok:
        raise CallFailed(f"it failed: {answer.decode(errors='replace') or 'without a reason'}")
    response = kind._response_class()
    try:
        response.deserialize(answer)
    except genpy.DeserializationError as fault:
        raise CallFailed(f"its answer can't be read: {fault}") from fault
    return response


def _serialized(kind: Any, request: tuple[Any, ...]) -> bytes:
    """The request with its length in front."""
    try:
        message = rospy.msg.args_kwds_to_message(kind, request, {})
        buffer = io.BytesIO()
        message.serialize(buffer)
    except (TypeError, genpy.SerializationError, struct.error) as fault:
        raise CallFailed(f"the request can't be sent: {fault}") from fault
    return struct.pack("<I", buffer.tell()) + buffer.getvalue()


def _shake_hands(connection: socket.socket, name: str, kind: Any) -> None:
    header = {
        "callerid": rospy.get_caller_id() or _master.CALLER,
        "service": name,
        "md5sum": kind._md5sum,
        "type": kind._type,
    }
    rosgraph.network.write_ros_handshake_header(connection, header)
    answer = rosgraph.network.read_ros_handshake_header(connection, io.BytesIO(), 65536)
    if "error" in answer:
        raise CallFailed(answer["error"])


def _read(connection: socket.socket, count: int) -> bytes:
    data = bytearray()
    while len(data) < count:
        part = connection.recv(min(65536, count - len(data)))
        if not part:
            raise ConnectionError("the connection ended before the answer")
        data += part
    return bytes(data)
