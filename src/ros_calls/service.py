"""A client for one service: a time limit on every call, and a connection that is renewed when it broke."""

from __future__ import annotations

import math
from typing import Any

import rospy

from ros_calls import master, tcpros
from ros_calls.absence import why_absent
from ros_calls.polling import AdaptivePoll
from ros_calls.xmlrpc import NoAnswer, Refused

TIMEOUT = 5.0  # [s] of wall time


class ServiceFailed(Exception):
    """The call failed; the text says which service, and why."""


class ServiceGone(ServiceFailed):
    """Nobody offers the service, or its node ended during the call."""


class ServiceMissing(ServiceGone):
    """The service was waited for, and didn't come."""


class ServiceHangs(ServiceFailed):
    """The node is there, but gave no answer in time."""


class ServiceClient:
    """Calls one service. Not thread-safe.

    rospy's ServiceProxy waits for ever on a node that hangs, and a persistent one keeps a connection to
    a node that has ended. This one does neither: after a failure the next call connects anew.

    Args:
        name: the service's name, global or relative to the node's namespace.
        kind: its generated class.
        persistent: keep the connection between calls; several times as fast.
        polls: look for an answer again and again before sleeping for it, where that pays (`polling.py`): for
            a service that is called again at once.
        timeout: wall time [s] that connecting and an answer may take; with infinity a call waits until
            the caller's node is shut down. The attribute may be changed.
    """

    def __init__(
        self,
        name: str,
        kind: Any,
        persistent: bool = False,
        timeout: float = TIMEOUT,
        polls: bool = False,
    ) -> None:
        self.name = str(rospy.resolve_name(name))
        self._kind = kind
        self._persistent = persistent
        self.timeout = timeout
        self._poll = AdaptivePoll() if polls else None
        self._connection: tcpros.Connection | None = None

    def __call__(self, *request: Any) -> Any:
        """Calls the service with a request, or with its fields in order, and returns the response.

        Raises:
            ServiceGone: not offered, or the connection broke; whether the call was carried out is
                then not known.
            ServiceHangs: no answer in time.
            ServiceFailed: the service refused, or the request can't be sent.
        """
        kept = False
        try:
            message = tcpros.request_message(self._kind, request)
            response = self._connected().call(message, self.timeout)
            kept = self._persistent
            return response
        except TimeoutError as fault:
            limit = "before the shutdown"
            if self.timeout < math.inf:
                limit = f"within {self.timeout:g} s"
            raise ServiceHangs(f"{self.name}: no answer {limit}") from fault
        except tcpros.ConnectionEnded as fault:
            raise ServiceGone(f"{self.name}: the connection broke; its node has ended") from fault
        except tcpros.CallFailed as fault:
            raise ServiceFailed(f"{self.name}: {fault}") from fault
        finally:
            if not kept:
                self.close()

    def call_idempotent(self, *request: Any) -> Any:
        """As a call, and calls once more if the kept connection was to a node that has ended.

        For requests that may be carried out twice.
        """
        if self._connection is not None:
            try:
                return self(*request)
            except ServiceGone:
                pass
        return self(*request)

    def _connected(self) -> tcpros.Connection:
        if self._connection is None:
            self._connection = tcpros.Connection(
                self._address(), self.name, self._kind, self.timeout, self._poll
            )
        return self._connection

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
        """Gives the connection up; the next call makes a new one."""
        if self._connection is not None:
            self._connection.close()
            self._connection = None
