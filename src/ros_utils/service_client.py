"""A client for one service: a time limit on every call, and a connection that is renewed when it broke."""

from __future__ import annotations

from typing import Any

import rospy

from ros_utils._internal import master as _master
from ros_utils._internal import tcpros as _tcpros

TIMEOUT = 5.0  # [s] of wall time


class ServiceFailed(Exception):
    """The call failed; the text says which service, and why."""


class ServiceGone(ServiceFailed):
    """Nobody offers the service, or its node ended during the call."""


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
        timeout: wall time [s] that connecting and an answer may take; the attribute may be changed.
    """

    def __init__(
        self, name: str, kind: Any, persistent: bool = False, timeout: float = TIMEOUT
    ) -> None:
        self.name = str(rospy.resolve_name(name))
        self._kind = kind
        self._persistent = persistent
        self.timeout = timeout
        self._connection: _tcpros.Connection | None = None

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
            message = _tcpros.request_message(self._kind, request)
            response = self._connected().call(message, self.timeout)
            kept = self._persistent
            return response
        except TimeoutError as fault:
            raise ServiceHangs(f"{self.name}: no answer within {self.timeout:g} s") from fault
        except _tcpros.ConnectionEnded as fault:
            raise ServiceGone(f"{self.name}: the connection broke; its node has ended") from fault
        except _tcpros.CallFailed as fault:
            raise ServiceFailed(f"{self.name}: {fault}") from fault
        finally:
            if not kept:
                self.close()

    def _connected(self) -> _tcpros.Connection:
        if self._connection is None:
            self._connection = _tcpros.Connection(
                self._address(), self.name, self._kind, self.timeout
            )
        return self._connection

    def _address(self) -> str:
        try:
            return str(_master.call(_master.uri(), "lookupService", self.name))
        except _master.Refused as fault:
            raise ServiceGone(f"{self.name}: nobody offers this service") from fault
        except _master.NoAnswer as fault:
            raise ServiceGone(f"{self.name}: the master at {_master.uri()}: {fault}") from fault

    def close(self) -> None:
        """Gives the connection up; the next call makes a new one."""
        if self._connection is not None:
            self._connection.close()
            self._connection = None
