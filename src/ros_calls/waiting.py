"""Bounded waits in wall time, because simulated time may stand still, run fast or go back."""

import socket
import time
from collections.abc import Callable
from typing import Any, TypeVar

import rosgraph
import rospy

from ros_calls import master
from ros_calls.absence import why_not_up
from ros_calls.master import CALLER, NoAnswer, Refused
from ros_calls.service import ServiceClient, ServiceFailed, ServiceMissing

POLL = 0.05  # [s] between two looks
TIMEOUT = 30.0  # [s] for a service to come up
CONNECTING = 1.0  # [s] for a node to accept a connection

Found = TypeVar("Found")


def wait_until(look: Callable[[], Found], timeout: float, what: str) -> Found:
    """Calls `look` until its result is true, and returns that; false after the timeout.

    Args:
        look: Called at least once.
        timeout: Limit of the wait [s], or infinity; the last look may exceed it.
        what: What is awaited, for the text of an interrupt.

    Raises:
        rospy.ROSInterruptException: The node shut down meanwhile.
    """
    deadline = time.monotonic() + timeout
    while not (result := look()):
        if rospy.is_shutdown():
            raise rospy.ROSInterruptException(f"shut down while waiting for {what}")
        if time.monotonic() > deadline:
            break
        time.sleep(POLL)
    return result


def service_answers(name: str) -> bool:
    """Returns True if a service, by its full name, is offered and its node accepts connections; no call."""
    try:
        address = rospy.core.parse_rosrpc_uri(master.call("lookupService", name))
        with socket.create_connection(address, CONNECTING) as connection:
            header = {"probe": "1", "md5sum": "*", "callerid": CALLER, "service": name}
            rosgraph.network.write_ros_handshake_header(connection, header)
    except (NoAnswer, Refused, rospy.ROSException, OSError):
        return False
    return True


def service_comes_up(name: str, timeout: float) -> bool:
    """Waits until a service answers, also while there is no master; returns False after `timeout` [s]."""
    resolved = str(rospy.resolve_name(name))
    return wait_until(lambda: service_answers(resolved), timeout, f"service {resolved}")


def wait_for_service(name: str, timeout: float = TIMEOUT) -> str:
    """Waits until a service can be called, and returns its resolved name; doubled slashes are harmless.

    Raises ServiceMissing after `timeout` [s], and at once without a master; rospy.ROSInterruptException if
    the node shut down meanwhile.
    """
    resolved = str(rospy.resolve_name(name))

    def look() -> bool:
        if service_answers(resolved):
            return True
        master.require()
        return False

    try:
        is_up = wait_until(look, timeout, f"service {resolved}")
    except master.MasterDown as fault:
        raise ServiceMissing(f"service {resolved}: {fault}") from fault
    if not is_up:
        raise ServiceMissing(
            f"service {resolved} didn't come up within {timeout:g} s: {why_not_up(resolved)}"
        )
    return resolved


def wait_and_call(name: str, kind: Any, *request: Any, timeout: float = TIMEOUT) -> Any:
    """Waits for a service, calls it with a request, or its fields in order, and returns the response.

    `timeout` limits the wait for the service, and again the call [s]. Raises ServiceFailed (see
    `ServiceClient`), ServiceMissing if it isn't up in time, rospy.ROSInterruptException if the node shut down
    meanwhile.
    """
    resolved = wait_for_service(name, timeout)
    try:
        return ServiceClient(resolved, kind, timeout=timeout)(*request)
    except ServiceFailed as fault:
        if rospy.is_shutdown():
            raise rospy.ROSInterruptException(f"shut down while calling {resolved}") from fault
        raise
