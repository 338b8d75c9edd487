"""Service calls on the wire: TCPROS, each with a time limit, under any master.

rospy's proxies have no time limit, keep a dead connection, and ask the process's own master even if they
know the address.
"""

from __future__ import annotations

import io
import math
import select
import socket
import struct
import time
from functools import partial
from typing import Any

import genpy
import rosgraph
import rospy

from ros_calls.polling import AdaptivePoll

CHUNK = 65536  # [bytes]
HEAD = struct.Struct("<BI")  # of an answer: whether the call succeeded, and its length
LENGTH = struct.Struct("<I")
CONNECTING = 10.0  # [s]; how long a call without a time limit may take to connect or to send
LOOK = 0.1  # [s]; how often such a call looks whether the node has been shut down


class CallFailed(Exception):
    """The call failed; the text says why."""


class ConnectionEnded(CallFailed):
    """The connection broke: the other side has ended."""


class Connection:
    """A lasting connection to one service. Not thread-safe.

    Time limits are wall time [s]; infinity means: until the caller's node is shut down.
    """

    def __init__(
        self, address: str, name: str, kind: Any, timeout: float, poll: AdaptivePoll | None = None
    ) -> None:
        """Connects to the service at a ``rosrpc://`` address; with `poll`, answers are polled for.

        Raises:
            CallFailed: no connection, or another type of service.
            TimeoutError: no answer in time.
        """
        self._kind = kind
        self._kernels_timeout = 0.0  # [s]; none is set yet
        self._poll = poll
        deadline = time.monotonic() + timeout
        try:
            host, port = rospy.core.parse_rosrpc_uri(address)
            self._socket = socket.create_connection((host, port), _finite(timeout))
            try:
                self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                self._shake_hands(name, deadline)
                looker = select.poll()
                looker.register(self._socket, select.POLLIN)
                self._has_come = partial(looker.poll, 0)
            except BaseException:
                self._socket.close()
                raise
        except TimeoutError:
            raise
        except (OSError, rosgraph.network.ROSHandshakeException, rospy.ROSException) as fault:
            raise ConnectionEnded(str(fault)) from fault

    def _shake_hands(self, name: str, deadline: float) -> None:
        header = {
            "callerid": rospy.get_caller_id(),
            "service": name,
            "md5sum": self._kind._md5sum,
            "type": self._kind._type,
            "persistent": "1",
        }
        rosgraph.network.write_ros_handshake_header(self._socket, header)
        self._await_data(deadline)
        answer = rosgraph.network.read_ros_handshake_header(self._socket, io.BytesIO(), CHUNK)
        if "error" in answer:
            raise CallFailed(answer["error"])

    def call(self, message: genpy.Message, timeout: float) -> Any:
        """Sends a request and returns the response.

        Raises:
            CallFailed: the service failed; ConnectionEnded: there is no connection any more.
            TimeoutError: no answer in time; the connection is of no use afterwards.
        """
        self.send(message, timeout)
        return self.receive(timeout)

    def send(self, message: genpy.Message, timeout: float) -> None:
        """Sends a request, whose answer `receive` must take before another one is sent.

        Raises:
            CallFailed: it can't be sent; ConnectionEnded: there is no connection any more.
            TimeoutError: it isn't taken in time; the connection is of no use afterwards.
        """
        payload = _serialized(message)
        try:
            self._set_timeout(_finite(timeout))
            self._socket.sendall(payload)
        except OSError as fault:
            raise _told(fault) from fault

    def receive(self, timeout: float) -> Any:
        """Returns the response to the request that was sent; its time limit begins now.

        Raises:
            CallFailed: the service failed; ConnectionEnded: there is no connection any more.
            TimeoutError: no answer in time; the connection is of no use afterwards.
        """
        deadline = time.monotonic() + timeout
        try:
            self._set_timeout(_finite(timeout))
            if timeout == math.inf:
                self._await_data(deadline)
            ok, answer = self._receive(deadline)
        except OSError as fault:
            raise _told(fault) from fault
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
        if timeout == self._kernels_timeout:
            return
        limit = struct.pack("@ll", int(timeout), int(timeout % 1.0 * 1e6))
        self._socket.settimeout(None)
        for option in (socket.SO_RCVTIMEO, socket.SO_SNDTIMEO):
            self._socket.setsockopt(socket.SOL_SOCKET, option, limit)
        self._kernels_timeout = timeout

    def _receive(self, deadline: float) -> tuple[bool, bytes]:
        """Reads one answer; most come in one piece, for which the kernel's time limit is enough."""
        data = self._first_part()
        while len(data) < HEAD.size:
            self._await_data(deadline)
            data += self._part()
        ok, length = HEAD.unpack_from(data)
        if len(data) == HEAD.size + length:
            return bool(ok), data[HEAD.size :]
        whole = bytearray(data)
        while len(whole) < HEAD.size + length:
            self._await_data(deadline)
            whole += self._part()
        return bool(ok), bytes(whole[HEAD.size :])

    def _first_part(self) -> bytes:
        if self._poll is None:
            return self._part()
        self._poll.before(self._has_come)
        part = self._part()
        self._poll.after()
        return part

    def _part(self) -> bytes:
        part = self._socket.recv(CHUNK)
        if not part:
            raise ConnectionError("the connection ended before the answer")
        return part

    def _await_data(self, deadline: float) -> None:
        """Returns once there is something to read, be it the end.

        Raises:
            TimeoutError: the deadline has passed, or it is infinity and the node is shut down.
        """
        poll = select.poll()
        poll.register(self._socket, select.POLLIN)
        left = deadline - time.monotonic()
        while not poll.poll(1000.0 * max(0.0, min(left, LOOK))):
            left = deadline - time.monotonic()
            if left <= 0.0 or (left == math.inf and rospy.is_shutdown()):
                raise TimeoutError

    def close(self) -> None:
        """Ends the connection."""
        self._socket.close()


def request_message(kind: Any, request: tuple[Any, ...]) -> genpy.Message:
    """The request, given as such or by its fields in order.

    Raises:
        CallFailed: if the fields are not the request's.
    """
    if len(request) == 1 and isinstance(request[0], kind._request_class):
        return request[0]
    try:
        return rospy.msg.args_kwds_to_message(kind._request_class, request, {})
    except TypeError as fault:
        raise CallFailed(f"the request can't be sent: {fault}") from fault


def _told(fault: OSError) -> Exception:
    """What a fault of the socket is: the kernel's time limit is told as BlockingIOError."""
    if isinstance(fault, BlockingIOError | TimeoutError):
        return TimeoutError()
    return ConnectionEnded(str(fault))


def _finite(timeout: float) -> float:
    return CONNECTING if timeout == math.inf else timeout


def _serialized(message: genpy.Message) -> bytes:
    """The request with its length in front."""
    buffer = io.BytesIO()
    buffer.seek(LENGTH.size)
    try:
        message.serialize(buffer)
    except (TypeError, genpy.SerializationError, struct.error) as fault:
        raise CallFailed(f"the request can't be sent: {fault}") from fault
    size = buffer.tell() - LENGTH.size
    buffer.seek(0)
    buffer.write(LENGTH.pack(size))
    return buffer.getvalue()
