"""Lasting connections to some services are polled for their next request, and some requests read by a
reader of the service's own."""

from __future__ import annotations

import io
import socket
import struct
import threading
from collections.abc import Callable, Iterator

import pytest
from rospy.exceptions import TransportTerminated
from rospy.impl.tcpros_base import TCPROSTransport
from rospy.impl.tcpros_service import ServiceImpl, TCPService
from std_srvs.srv import SetBool, SetBoolRequest

from bullet_gazebo.ros.common import rospy_polling as polling
from bullet_gazebo.ros.common.rospy_polling import PolledService
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
        self._ends: list[socket.socket] = []

    def _make(self) -> AdaptivePoll:
        ticks = iter(range(10**9))
        self.polls.append(AdaptivePoll(lambda: next(ticks) * 1e-6))
        return self.polls[-1]

    def connect(
        self, header: dict[str, str], reader: Callable[[], polling.Reader] = polling.NoReader
    ) -> tuple[socket.socket, Callable[[], list[bool]]]:
        """The client's end, and what reads the requests that have come."""
        client, own = socket.socketpair()
        client.settimeout(BOUND)
        self._ends += [client, own]
        transport = TCPROSTransport(TCPService("/served", SetBool), "/served")
        transport.set_socket(own, "/client")
        service = PolledService.__new__(PolledService)
        service._reader = reader
        service.handle(transport, header)
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
    client, receive = served.connect(PERSISTENT)
    for count in range(20):
        client.sendall(on_the_wire(count % 2 == 0))
        assert receive() == [count % 2 == 0]
        assert served.polls[0].looks == max(0, count + 1 - RECENT)
    client.close()
    with pytest.raises(TransportTerminated):
        receive()


def test_one_that_has_come_with_another_is_not_polled_for(served: Served) -> None:
    client, receive = served.connect(PERSISTENT)
    for _ in range(RECENT):
        client.sendall(on_the_wire(True))
        receive()
    client.sendall(on_the_wire(True, False, True))
    got: list[bool] = []
    while len(got) < 3:
        got += receive()
    assert got == [True, False, True]
    assert served.polls[0].looks == 1


@pytest.mark.parametrize("header", [{}, {"persistent": "0"}])
def test_single_calls_are_slept_for(served: Served, header: dict[str, str]) -> None:
    client, receive = served.connect(header)
    client.sendall(on_the_wire(True))
    assert receive() == [True]
    assert not served.polls


class Trues:
    """Knows the request that says True, once it has been told of one."""

    def __init__(self) -> None:
        self.told: list[tuple[bytes, bool]] = []

    def read(self, data: bytes) -> SetBoolRequest | None:
        return SetBoolRequest(data="known") if (data, True) in self.told else None

    def learn(self, data: bytes, request: SetBoolRequest) -> None:
        self.told.append((data, request.data))


def test_a_reader_learns_what_comes_and_reads_what_it_knows(served: Served) -> None:
    """What comes in two parts, and what comes with another one, included."""
    reader = Trues()
    client, receive = served.connect(PERSISTENT, lambda: reader)
    one, other = on_the_wire(True), on_the_wire(False)
    for data, read in ((other, [False]), (one, [True]), (one, ["known"]), (other, [False])):
        client.sendall(data)
        assert receive() == read
    assert reader.told == [(other, False), (one, True), (other, False)]
    client.sendall(one + other)
    assert receive() == [True, False]
    client.sendall(one[:2])
    late = threading.Timer(0.05, client.sendall, [one[2:]])
    late.start()
    assert receive() == [True]
    late.join()
    client.sendall(one)
    assert receive() == ["known"]
    client.close()
    with pytest.raises(TransportTerminated):
        receive()
