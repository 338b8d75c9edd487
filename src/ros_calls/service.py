"""A client for one service that limits the time of every call and renews a broken connection.

rospy's proxies have no time limit, keep a dead connection, and ask the process's own master even when they
know the address.
"""

import contextlib
import io
import math
import select
import socket
import struct
import time
import traceback
from typing import Any

import genpy
import rosgraph
import rospy

from ros_calls import master
from ros_calls.absence import why_absent
from ros_calls.master import NoAnswer, Refused

TIMEOUT = 5.0  # [s] of wall time
CHUNK = 65536  # [bytes]
HEAD = struct.Struct("<BI")  # of an answer: whether the call succeeded, and its length
LENGTH = struct.Struct("<I")
CONNECTING = 10.0  # [s] to connect or to send, for a call without a time limit
LOOK = 0.1  # [s] between two checks of such a call for the node's shutdown
WORK = "gazeboWork"  # XML-RPC method of a simulator's node: a number that grows while it computes
ANSWERING = 10.0  # [s] for that; a picture's rays may keep Python's lock for seconds
WORKING = 1.0  # [s] between two looks at it


class ServiceFailed(Exception):
    """The call failed; the text says which service, and why."""


class ServiceGone(ServiceFailed):
    """No one offers the service, or its node ended during the call."""


class ServiceMissing(ServiceGone):
    """The service didn't come up in time."""


class ServiceHangs(ServiceFailed):
    """The node is registered, but didn't answer in time."""


class ServiceClient:
    """Calls one service. Not thread-safe.

    A call is `begin` and `end`: several services work in parallel if all calls begin before the first
    one ends.

    rospy's ServiceProxy waits forever for a node that hangs, and a persistent one keeps the connection
    to a node that has ended. This client does neither: after a failure the next call reconnects.

    Args:
        name: The service's name, global or relative to the node's namespace.
        kind: The service's generated class.
        persistent: Keep the connection between calls, which is several times as fast.
        timeout: Limit for connecting and for an answer [s of wall time]; with infinity a call waits
            until the caller's node shuts down. The attribute may be changed.
    """

    def __init__(self, name: str, kind: Any, persistent: bool = False, timeout: float = TIMEOUT) -> None:
        self.name = str(rospy.resolve_name(name))
        self._kind = kind
        self._persistent = persistent
        self.timeout = timeout
        self._connection: Connection | None = None
        self._begun = False  # whether an answer is outstanding

    def __call__(self, *request: Any) -> Any:
        """Calls the service with a request, or with its fields in order, and returns the response.

        Raises:
            ServiceGone: No node offers the service, or the connection broke; the call may or may not
                have been carried out.
            ServiceHangs: No answer in time.
            ServiceFailed: The service reported a failure, or the request can't be sent.
        """
        try:
            self.begin(*request)
            return self.end()
        except BaseException:  # a signal handler may raise anywhere
            self.close()
            raise

    def begin(self, *request: Any) -> None:
        """Sends a request and returns at once; `end` takes the response, and must come next.

        Raises:
            ServiceFailed: As for a call.
            RuntimeError: A call was begun and not ended.
        """
        if self._begun:
            raise RuntimeError(f"{self.name}: begin() once more before end()")
        try:
            message = request_message(self._kind, request)
            if self._connection is None:
                self._connection = Connection(self._address(), self.name, self._kind, self.timeout)
            self._connection.send(message, self.timeout)
            self._begun = True
        except (TimeoutError, CallFailed) as fault:
            raise self._failure(fault) from fault
        finally:
            if not self._begun:
                self.close()

    def end(self) -> Any:
        """Waits for the response to `begin` and returns it; the time limit starts again.

        Raises:
            ServiceFailed: As for a call.
            RuntimeError: No call was begun, or `close` was called since.
        """
        if not self._begun or self._connection is None:
            raise RuntimeError(f"{self.name}: end() without begin()")
        self._begun = kept = False
        try:
            response = self._connection.receive(self.timeout)
            kept = self._persistent
            return response
        except (TimeoutError, CallFailed) as fault:
            raise self._failure(fault) from fault
        finally:
            if not kept:
                self.close()

    def call_idempotent(self, *request: Any) -> Any:
        """Calls the service, again if a kept connection's node has ended; for what may be done twice."""
        if self._connection is not None:
            with contextlib.suppress(ServiceGone):
                return self(*request)
        return self(*request)

    def _failure(self, fault: Exception) -> ServiceFailed:
        if isinstance(fault, TimeoutError):
            is_bounded = self.timeout < math.inf
            limit = f"within {self.timeout:g} s" if is_bounded else "before the shutdown"
            return ServiceHangs(f"{self.name}: no answer {limit}")
        if isinstance(fault, ConnectionEnded):
            return ServiceGone(f"{self.name}: the connection broke; its node has ended")
        return ServiceFailed(f"{self.name}: {fault}")

    def _address(self) -> str:
        try:
            try:
                return str(master.call("lookupService", self.name))
            except Refused as fault:
                raise ServiceGone(f"{self.name}: {why_absent(self.name)}") from fault
        except NoAnswer as fault:
            raise ServiceGone(
                f"{self.name}: no ROS master at {master.uri()} ({fault}): start roscore or launch a "
                "simulator, or mend ROS_MASTER_URI"
            ) from fault

    def close(self) -> None:
        """Closes the connection and drops a begun call; the next call reconnects."""
        self._begun = False
        if self._connection is not None:
            self._connection.close()
            self._connection = None


class CallFailed(Exception):
    """The call failed; the text says why."""


class ConnectionEnded(CallFailed):
    """The connection broke: the other side has ended."""


class Connection:
    """A lasting connection to the service at a ``rosrpc://`` address. Not thread-safe.

    Time limits are wall time [s]; infinity means until the caller's node shuts down. After a TimeoutError the
    connection can't be used any more.

    Raises:
        CallFailed: The connection failed, or the service has another type.
        TimeoutError: No answer in time.
    """

    def __init__(self, address: str, name: str, kind: Any, timeout: float) -> None:
        self._kind = kind
        deadline = time.monotonic() + timeout
        try:
            host, port = rospy.core.parse_rosrpc_uri(address)
            self._socket = socket.create_connection((host, port), _finite(timeout))
            try:
                self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                self._shake_hands(name, deadline)
            except BaseException:
                self._socket.close()
                raise
        except TimeoutError:
            raise
        except (OSError, rosgraph.network.ROSHandshakeException, rospy.ROSException) as fault:
            raise ConnectionEnded(str(fault)) from fault

    def _shake_hands(self, name: str, deadline: float) -> None:
        header = {
            "callerid": rospy.get_caller_id(), "service": name, "md5sum": self._kind._md5sum,
            "type": self._kind._type, "persistent": "1",
        }  # fmt: skip
        rosgraph.network.write_ros_handshake_header(self._socket, header)
        self._await_data(deadline)
        answer = rosgraph.network.read_ros_handshake_header(self._socket, io.BytesIO(), CHUNK)
        if "error" in answer:
            raise CallFailed(answer["error"])
        self._node = answer.get("callerid", "")

    def send(self, message: genpy.Message, timeout: float) -> None:
        """Sends a request; `receive` must take its answer before the next one."""
        payload = _serialized(message)
        try:
            self._socket.settimeout(_finite(timeout))
            self._socket.sendall(payload)
        except TimeoutError:
            raise
        except OSError as fault:
            raise ConnectionEnded(str(fault)) from fault

    def receive(self, timeout: float) -> Any:
        """Returns the response to the last request; the time limit starts now.

        While a simulator in lock-step computes, no limit ends the wait.
        """
        try:
            self._socket.settimeout(_finite(timeout))
            ok, answer = self._receive(timeout)
        except TimeoutError:
            raise
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

    def _receive(self, timeout: float) -> tuple[bool, bytes]:
        """Reads one answer; for one in a single piece, as most are, the socket's time limit is enough."""
        deadline, data = time.monotonic() + timeout, bytearray()
        while len(data) < HEAD.size or len(data) < HEAD.size + HEAD.unpack_from(data)[1]:
            try:
                if data or timeout == math.inf:
                    self._await_data(deadline)
                part = self._socket.recv(CHUNK)
                if not part:
                    raise ConnectionError("the connection ended before the answer")
                data += part
            except TimeoutError as fault:
                ours = raised_in(fault) == __name__  # not in a signal's handler in the middle of it
                if timeout == math.inf or not ours or not self._computes():
                    raise
                deadline = time.monotonic() + timeout
        return bool(data[0]), bytes(data[HEAD.size :])

    def _computes(self) -> bool:
        """Returns whether the node is a simulator in lock-step that computes, or has answered meanwhile."""
        try:
            uri = master.call("lookupNode", self._node)
            before = master.call_node(uri, WORK, timeout=ANSWERING)
            poll = select.poll()
            poll.register(self._socket, select.POLLIN)
            return bool(poll.poll(1000.0 * WORKING)) or bool(
                master.call_node(uri, WORK, timeout=ANSWERING) != before
            )
        except (NoAnswer, Refused):
            return False

    def _await_data(self, deadline: float) -> None:
        """Waits for data; raises TimeoutError at the deadline, without one when the node shuts down."""
        poll = select.poll()
        poll.register(self._socket, select.POLLIN)
        left = deadline - time.monotonic()
        while not poll.poll(1000.0 * max(0.0, min(left, LOOK))):
            left = deadline - time.monotonic()
            if left <= 0.0 or (left == math.inf and rospy.is_shutdown()):
                raise TimeoutError

    def close(self) -> None:
        """Closes the connection."""
        self._socket.close()


def request_message(kind: Any, request: tuple[Any, ...]) -> genpy.Message:
    """Returns the request, given as a message or by its fields; raises CallFailed if they don't fit."""
    if len(request) == 1 and isinstance(request[0], kind._request_class):
        return request[0]
    try:
        return rospy.msg.args_kwds_to_message(kind._request_class, request, {})
    except TypeError as fault:
        raise CallFailed(f"the request can't be sent: {fault}") from fault


def bytes_of(message: genpy.Message) -> bytes:
    """Returns a message as it goes over the wire, without its length."""
    buffer = io.BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


def raised_in(fault: BaseException) -> str:
    """Returns the name of the module that has raised an exception."""
    frames = [frame for frame, _ in traceback.walk_tb(fault.__traceback__)]
    return str(frames[-1].f_globals.get("__name__", "")) if frames else ""


def _finite(timeout: float) -> float:
    return CONNECTING if timeout == math.inf else timeout


def _serialized(message: genpy.Message) -> bytes:
    """Returns the request's bytes, with their length in front."""
    try:
        content = bytes_of(message)
    except (TypeError, genpy.SerializationError, struct.error) as fault:
        raise CallFailed(f"the request can't be sent: {fault}") from fault
    return LENGTH.pack(len(content)) + content
