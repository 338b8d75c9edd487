"""Persistent connections to some services are polled for their next request; all others aren't."""

from __future__ import annotations

import io
import socket
import struct
from collections.abc import Callable, Iterator

import pytest
from rospy.exceptions import TransportTerminated
from rospy.impl.tcpros_base import TCPROSTransport
from rospy.impl.tcpros_service import ServiceImpl, TCPService
from std_srvs.srv import Empty, SetBool, SetBoolRequest

from bullet_gazebo.ros.wire.rospy_patches import polling
from ros_calls import polling as general
from ros_calls.polling import RECENT, AdaptivePoll

PERSISTENT = {"persistent": "1"}
BOUND = 30.0  # [s]


def on_the_wire(*values: bool) -> bytes:
    """Requests, one behind the other."""
    whole = b""
    for value in values:
        buffer = io.BytesIO()
        SetBoolRequest(value).serialize(buffer)
        whole += struct.pack("<I", buffer.tell()) + buffer.getvalue()
    return whole


class Served:
    """Connections to a service whose requests are read by the test; a poll's clock counts how often it is
    asked."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.polls: list[AdaptivePoll] = []
        self.handled: list[TCPROSTransport] = []
        monkeypatch.delenv(general.SWITCH, raising=False)
        monkeypatch.setattr(general, "cores", lambda: 2)
        monkeypatch.setattr(general, "running", lambda: 2)
        monkeypatch.setattr(polling, "AdaptivePoll", self._make)
        monkeypatch.setattr(
            ServiceImpl, "handle", lambda _self, transport, _header: self.handled.append(transport)
        )
        polling.poll_for_requests(SetBool)
        self._ends: list[socket.socket] = []

    def _make(self) -> AdaptivePoll:
        ticks = iter(range(10**9))
        self.polls.append(AdaptivePoll(lambda: next(ticks) * 1e-6))
        return self.polls[-1]

    def connect(
        self, kind: type, header: dict[str, str]
    ) -> tuple[socket.socket, Callable[[], list[bool]]]:
        """The client's end, and what reads the requests that have come."""
        client, own = socket.socketpair()
        client.settimeout(BOUND)
        self._ends += [client, own]
        transport = TCPROSTransport(TCPService("/served", SetBool), "/served")
        transport.set_socket(own, "/client")
        service = ServiceImpl.__new__(ServiceImpl)
        service.request_class = kind._request_class
        ServiceImpl.handle(service, transport, header)
        assert self.handled[-1] is transport
        return client, lambda: [request.data for request in self.handled[-1].receive_once()]

    def close(self) -> None:
        for end in self._ends:
            end.close()


@pytest.fixture
def served(monkeypatch: pytest.MonkeyPatch) -> Iterator[Served]:
    made = Served(monkeypatch)
    yield made
    made.close()


def test_requests_are_the_same_and_polled_for_once_they_follow_each_other(served: Served) -> None:
    client, receive = served.connect(SetBool, PERSISTENT)
    for count in range(20):
        client.sendall(on_the_wire(count % 2 == 0))
        assert receive() == [count % 2 == 0]
        assert served.polls[0].looks == max(0, count + 1 - RECENT)
    client.close()
    with pytest.raises(TransportTerminated):
        receive()


def test_one_that_has_come_with_another_is_not_polled_for(served: Served) -> None:
    client, receive = served.connect(SetBool, PERSISTENT)
    for _ in range(RECENT):
        client.sendall(on_the_wire(True))
        receive()
    client.sendall(on_the_wire(True, False, True))
    got: list[bool] = []
    while len(got) < 3:
        got += receive()
    assert got == [True, False, True]
    assert served.polls[0].looks == 1


@pytest.mark.parametrize(
    ("kind", "header"), [(SetBool, {}), (SetBool, {"persistent": "0"}), (Empty, PERSISTENT)]
)
def test_single_calls_and_other_services_are_slept_for(
    served: Served, kind: type, header: dict[str, str]
) -> None:
    client, receive = served.connect(kind, header)
    client.sendall(on_the_wire(True))
    assert receive() == [True]
    assert not served.polls
