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

    A call is `begin` and `end`: several services do their work at the same time if all are begun before
    the first one is ended.

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
        self._begun = False  # whether an answer is still to be taken

    def __call__(self, *request: Any) -> Any:
        """Calls the service with a request, or with its fields in order, and returns the response.

        Raises:
            ServiceGone: not offered, or the connection broke; whether the call was carried out is
                then not known.
            ServiceHangs: no answer in time.
            ServiceFailed: the service refused, or the request can't be sent.
        """
        self._refuse_if_begun()
        try:
            self.begin(*request)
            return self.end()
        except BaseException:  # also of a signal's handler, at any place
            self.close()
            raise

    def begin(self, *request: Any) -> None:
        """Sends a request and returns at once; `end` takes the response, and must come next.

        Raises:
            ServiceFailed: as for a call.
            RuntimeError: if a call was begun, and not ended.
        """
        self._refuse_if_begun()
        try:
            message = tcpros.request_message(self._kind, request)
            self._connected().send(message, self.timeout)
            self._begun = True
        except (TimeoutError, tcpros.CallFailed) as fault:
            raise self._failure(fault) from fault
        finally:
            if not self._begun:
                self.close()

    def end(self) -> Any:
        """Waits for the response to what was begun; the time limit begins anew.

        Raises:
            ServiceFailed: as for a call.
            RuntimeError: if no call was begun, or `close` was called since.
        """
        if not self._begun or self._connection is None:
            raise RuntimeError(f"{self.name}: end() without begin()")
        self._begun = kept = False
        try:
            response = self._connection.receive(self.timeout)
            kept = self._persistent
            return response
        except (TimeoutError, tcpros.CallFailed) as fault:
            raise self._failure(fault) from fault
        finally:
            if not kept:
                self.close()

    def _refuse_if_begun(self) -> None:
        if self._begun:
            raise RuntimeError(f"{self.name}: begin() once more before end()")

    def _failure(self, fault: Exception) -> ServiceFailed:
        if isinstance(fault, TimeoutError):
            limit = "before the shutdown"
            if self.timeout < math.inf:
                limit = f"within {self.timeout:g} s"
            return ServiceHangs(f"{self.name}: no answer {limit}")
        if isinstance(fault, tcpros.ConnectionEnded):
            return ServiceGone(f"{self.name}: the connection broke; its node has ended")
        return ServiceFailed(f"{self.name}: {fault}")

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
        """Gives the connection up, and what was begun; the next call makes a new one."""
        self._begun = False
        if self._connection is not None:
            self._connection.close()
            self._connection = None
