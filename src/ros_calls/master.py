"""The ROS master that calls go to: ROS_MASTER_URI's, unless a block says otherwise.

rospy knows one master for each process; here each thread may turn to another one for a while.
"""

from __future__ import annotations

import contextlib
import functools
import socket
from contextvars import ContextVar
from typing import Any
from urllib.parse import urlsplit

import rosgraph

from ros_calls import xmlrpc

_chosen: ContextVar[str | None] = ContextVar("ros_master", default=None)


class MasterDown(Exception):
    """No ROS master can be used; the text says where it was looked for and what to do."""

    port_is_free = False  # nobody listens there, so a master could be started


def uri() -> str:
    """The master's address: the block's, or ``__master:=`` of the command line, or
    ROS_MASTER_URI."""
    return _chosen.get() or str(rosgraph.get_master_uri())


class _Chosen:
    """A block; a class, because each step over ROS has one, and a generator takes three times as long."""

    __slots__ = ("_token", "_uri")

    def __init__(self, master_uri: str) -> None:
        self._uri = master_uri

    def __enter__(self) -> None:
        self._token = _chosen.set(self._uri)

    def __exit__(self, *_: object) -> None:
        _chosen.reset(self._token)


def using(master_uri: str | None) -> contextlib.AbstractContextManager[None]:
    """Within the block, in this thread, calls go to another master; None changes nothing.

    The environment stays as it is, so nothing else in the process notices.
    """
    return contextlib.nullcontext() if master_uri is None else _Chosen(master_uri)


def call(method: str, *args: Any, timeout: float = xmlrpc.TIMEOUT) -> Any:
    """Calls a method of the master. See `xmlrpc.call_plain` for what it raises."""
    return xmlrpc.call(uri(), method, *args, timeout=timeout)


def require(timeout: float = xmlrpc.TIMEOUT) -> None:
    """Returns if the master answers within `timeout` [s].

    Raises:
        MasterDown: it doesn't, with the reason.
    """
    host_and_port()
    try:
        call("getPid", timeout=timeout)
    except (xmlrpc.NoAnswer, xmlrpc.Refused) as fault:
        down = MasterDown(
            f"no ROS master at {uri()} ({fault}): start roscore or launch a simulator,"
            " or mend ROS_MASTER_URI"
        )
        down.port_is_free = isinstance(fault, xmlrpc.NobodyListens)
        raise down from fault


def is_up_or_startable() -> bool:
    """True if the master answers, False if there is none but one can be started at its address.

    Raises:
        MasterDown: the address is on another machine that doesn't answer, or something else holds
            the port. (roslaunch itself would wait for minutes.)
    """
    try:
        require()
    except MasterDown as down:
        if not is_local():
            raise
        if not down.port_is_free:
            raise MasterDown(
                f"{uri()}: the port is in use, and not by a ROS master ({down.__cause__}):"
                " set ROS_MASTER_URI to a free port"
            ) from down
        return False
    return True


def is_up() -> bool:
    """True if the master answers."""
    try:
        require()
    except MasterDown:
        return False
    return True


def host_and_port() -> tuple[str, int]:
    """Host and port of the master.

    Raises:
        MasterDown: ROS_MASTER_URI is no address.
    """
    try:
        parts = urlsplit(uri())
        host, port = parts.hostname, parts.port
    except ValueError:
        host = port = None
    if not host or not port:
        raise MasterDown(
            f"ROS_MASTER_URI is {uri()!r}: expected something like http://localhost:11311"
        )
    return host, port


def is_local() -> bool:
    """True if the master's host is this machine."""
    return host_is_local(host_and_port()[0])


@functools.cache  # may ask a name server
def host_is_local(host: str) -> bool:
    """True if the host is this machine, by whatever name."""
    return (
        host == "localhost"
        or host.startswith("127.")
        or bool(rosgraph.network.is_local_address(host))
    )


def is_at(address: str) -> bool:
    """True if an address of a master means the present one, whatever name of its host is used."""
    host, port = host_and_port()
    try:
        parts = urlsplit(address)
        if parts.hostname is None or parts.port != port:
            return False
    except ValueError:
        return False
    return parts.hostname == host or _same_machine(parts.hostname, host)


def _same_machine(one: str, other: str) -> bool:
    if host_is_local(one) or host_is_local(other):
        return host_is_local(one) and host_is_local(other)
    try:
        return socket.gethostbyname(one) == socket.gethostbyname(other)
    except OSError:
        return False
