"""Requests that follow each other on a lasting connection: polled for, and read in one piece.

- `PolledService`: the thread that serves a client sleeps between two steps, and waking it may take longer
  than a step; and reading a request takes half as long as the step itself (test_rospy_polling.py)
"""

from collections.abc import Callable
from functools import partial
from select import POLLIN, poll
from typing import Any, Protocol

import genpy
import rospy
from rospy.exceptions import TransportTerminated
from rospy.impl.tcpros_base import TCPROSTransport
from rospy.impl.tcpros_service import ServiceImpl

from ros_calls.polling import AdaptivePoll


class Reader(Protocol):
    """Knows requests that are like one before, and reads them in less time than genpy."""

    def read(self, data: bytes) -> genpy.Message | None:
        """Reads what came, length in front; None: it isn't such a request, or not a whole one alone."""
        ...

    def learn(self, data: bytes, request: genpy.Message) -> None:
        """Is told what genpy reads in it."""
        ...


class NoReader:
    """Knows none."""

    def read(self, _data: bytes) -> None:
        pass

    def learn(self, _data: bytes, _request: genpy.Message) -> None:
        pass


class PolledService(rospy.Service):
    """A service whose lasting connections are polled for the next request before their thread sleeps."""

    def __init__(
        self,
        name: str,
        kind: Any,
        handler: Callable[[Any], genpy.Message],
        reader: Callable[[], Reader] = NoReader,
    ) -> None:
        """`reader` makes one for each connection."""
        self._reader = reader
        super().__init__(name, kind, handler)

    def handle(self, transport: TCPROSTransport, header: dict[str, str]) -> None:
        """Serves one client, in a thread of its own."""
        if header.get("persistent", "").lower() in ("1", "true"):
            _poll(transport, AdaptivePoll(), self._reader())
        ServiceImpl.handle(self, transport, header)  # as others have changed it meanwhile


def _poll(transport: TCPROSTransport, polling: AdaptivePoll, reader: Reader) -> None:
    sock, buffer, size = transport.socket, transport.read_buff, transport.protocol.buff_size
    looker = poll()
    looker.register(sock, POLLIN)
    has_come = partial(looker.poll, 0)
    receive = transport.receive_once
    sock.setblocking(True)

    def receive_awake() -> list[Any]:
        if buffer.tell():  # the next one has come with the last one
            return list(receive())
        polling.before(has_come)
        try:
            data = sock.recv(size)
        except OSError as error:
            raise TransportTerminated(str(error)) from error
        polling.after()
        if not data:
            raise TransportTerminated("the client has gone")
        known = reader.read(data)
        if known is not None:
            return [known]
        buffer.write(data)
        received: list[Any] = receive()
        if received:
            reader.learn(data, received[0])
        return received

    transport.receive_once = receive_awake
