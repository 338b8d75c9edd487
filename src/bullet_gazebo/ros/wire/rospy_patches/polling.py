"""Requests that follow each other, polled for before their thread sleeps; see the package's docstring.

- `poll_for_requests`: the thread that serves a client sleeps between two steps, and waking it may take
  longer than a step (test_polling.py)
"""

from functools import partial
from select import POLLIN, poll
from typing import Any

from rospy.impl.tcpros_base import TCPROSTransport
from rospy.impl.tcpros_service import ServiceImpl

from ros_calls.polling import AdaptivePoll


def poll_for_requests(*kinds: Any) -> None:
    """Has lasting connections to services of some types polled for the next request; before there are any.

    Args:
        kinds: the types' generated classes.
    """
    hot = {kind._request_class for kind in kinds}
    handle = ServiceImpl.handle

    def handle_awake(
        service: ServiceImpl, transport: TCPROSTransport, header: dict[str, str]
    ) -> None:
        if service.request_class in hot and header.get("persistent", "").lower() in ("1", "true"):
            _poll(transport, AdaptivePoll())
        handle(service, transport, header)

    ServiceImpl.handle = handle_awake


def _poll(transport: TCPROSTransport, polling: AdaptivePoll) -> None:
    looker = poll()
    looker.register(transport.socket, POLLIN)
    has_come = partial(looker.poll, 0)
    receive = transport.receive_once

    def receive_awake() -> list[Any]:
        if not transport.read_buff.tell():  # else the next one has come with the last one
            polling.before(has_come)
            received: list[Any] = receive()
            polling.after()
            return received
        return list(receive())

    transport.receive_once = receive_awake
