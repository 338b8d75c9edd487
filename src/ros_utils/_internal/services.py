"""Service calls with a time limit on every step, also before ``rospy.init_node``."""

from __future__ import annotations

import socket
import time
from typing import Any

import rosgraph
import rospy

from ros_utils._internal import master as _master
from ros_utils._internal import tcpros as _tcpros

TIMEOUT = 30.0  # [s]


class ServiceError(Exception):
    """The call failed; the text says which service, and why."""


class Missing(ServiceError):
    """The service isn't there or doesn't answer, and has been waited for: trying again at once
    won't help."""


def answers(name: str, timeout: float = 1.0) -> bool:
    """True if the service is offered and its node accepts connections (the service isn't
    called)."""
    try:
        host, port = rospy.core.parse_rosrpc_uri(_master.call(_master.uri(), "lookupService", name))
        with socket.create_connection((host, port), timeout) as connection:
            header = {"probe": "1", "md5sum": "*", "callerid": _master.CALLER, "service": name}
            rosgraph.network.write_ros_handshake_header(connection, header)
    except (_master.NoAnswer, _master.Refused, rospy.ROSException, OSError):
        return False
    return True


def wait_for(name: str, timeout: float = TIMEOUT) -> str:
    """Wait until a service can be called.

    Args:
        name: the service, global or relative to the node's namespace; doubled slashes do no harm.
        timeout: bound of the wait [s].

    Returns:
        The resolved name.

    Raises:
        Missing: no master, or the service doesn't come in time.
        rospy.ROSInterruptException: the node was shut down meanwhile.
    """
    resolved = str(rospy.resolve_name(name))
    deadline = time.monotonic() + timeout
    while not answers(resolved):
        try:
            _master.require()
        except _master.MasterDown as fault:
            raise Missing(f"service {resolved}: {fault}") from fault
        if rospy.is_shutdown():
            raise rospy.ROSInterruptException(f"shut down while waiting for service {resolved}")
        if time.monotonic() > deadline:
            raise Missing(
                f"service {resolved} didn't come up within {timeout:g} s: does its node run?"
            )
        time.sleep(_master.POLL)
    return resolved


def call(name: str, service_class: Any, *request: Any, timeout: float = TIMEOUT) -> Any:
    """Wait for a service and call it.

    Args:
        name: the service.
        service_class: its type.
        request: the request, or its fields in order.
        timeout: bound of the wait for the service, and again of the wait for its answer [s].

    Raises:
        Missing: not there in time, or no answer in time.
        ServiceError: the call itself failed.
        rospy.ROSInterruptException: the node was shut down meanwhile.
    """
    resolved = wait_for(name, timeout)
    try:
        address = str(_master.call(_master.uri(), "lookupService", resolved))
        return _tcpros.call(address, resolved, service_class, request, timeout)
    except TimeoutError as fault:
        raise Missing(
            f"service {resolved} gave no answer within {timeout:g} s: its node hangs or is paused"
        ) from fault
    except (_master.NoAnswer, _master.Refused, _tcpros.CallFailed) as fault:
        if rospy.is_shutdown():
            raise rospy.ROSInterruptException(f"shut down while calling {resolved}") from fault
        raise ServiceError(f"service {resolved}: {fault}") from fault
