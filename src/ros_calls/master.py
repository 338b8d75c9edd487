"""Calls of the ROS master and of nodes, with a time limit.

rospy's own XML-RPC proxies have none: behind a dead network they hang their callers for minutes. rospy knows
one master for each process; here each thread may turn to another one for a while.
"""

from __future__ import annotations

import contextlib
import functools
import http.client
import socket
import xmlrpc.client
from contextvars import ContextVar
from typing import Any
from urllib.parse import urlsplit
from xml.parsers.expat import ExpatError

import rosgraph

CALLER = "/ros_calls"  # whom a master or node notes; nothing depends on it
TIMEOUT = 2.0  # [s] for one question to a master or node; a live one answers in milliseconds

_chosen: ContextVar[str | None] = ContextVar("ros_master", default=None)


class NoAnswer(Exception):
    """Nothing usable came back; the text says why."""


class NobodyListens(NoAnswer):
    """The connection was refused."""


class BadAnswer(NoAnswer):
    """Somebody answers, but not in ROS's way, or doesn't know the method."""


class Refused(Exception):
    """The other side answered, and its answer is no."""


class _Transport(xmlrpc.client.Transport):
    """XML-RPC over HTTP with a time limit on every socket operation."""

    def __init__(self, timeout: float) -> None:
        super().__init__()
        self._timeout = timeout

    def make_connection(self, host: Any) -> http.client.HTTPConnection:
        connection = super().make_connection(host)
        connection.timeout = self._timeout
        return connection


def call_node(uri: str, method: str, *args: Any, timeout: float = TIMEOUT) -> Any:
    """Calls a method of a master or node, which want the caller's name as first argument.

    See `call_plain`.
    """
    return call_plain(uri, method, CALLER, *args, timeout=timeout)


def call_plain(uri: str, method: str, *args: Any, timeout: float = TIMEOUT) -> Any:
    """Calls a method of something that answers in ROS's way, ``[code, text, value]``.

    Args:
        uri: its ``http://`` address.
        method: the method's name.
        args: all of its arguments.
        timeout: wall time [s] that connecting, sending and each part of the answer may take.

    Returns:
        The value.

    Raises:
        NoAnswer: nothing usable came back.
        Refused: the answer's code is not 1.
    """
    try:
        with xmlrpc.client.ServerProxy(uri, transport=_Transport(timeout)) as proxy:
            code, text, value = getattr(proxy, method)(*args)
    except TimeoutError as fault:
        raise NoAnswer(f"no answer within {timeout:g} s") from fault
    except ConnectionRefusedError as fault:
        raise NobodyListens(fault.strerror or str(fault)) from fault
    except OSError as fault:
        raise NoAnswer(fault.strerror or str(fault)) from fault
    except (
        http.client.HTTPException,
        xmlrpc.client.Error,
        ExpatError,
        TypeError,
        ValueError,
    ) as fault:
        raise BadAnswer(f"an answer that is not ROS's: {type(fault).__name__}") from fault
    if code != 1:
        raise Refused(text)
    return value


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


def call(method: str, *args: Any, timeout: float = TIMEOUT) -> Any:
    """Calls a method of the master. See `call_plain` for what it raises."""
    return call_node(uri(), method, *args, timeout=timeout)


def require(timeout: float = TIMEOUT) -> None:
    """Returns if the master answers within `timeout` [s].

    Raises:
        MasterDown: it doesn't, with the reason.
    """
    host_and_port()
    try:
        call("getPid", timeout=timeout)
    except (NoAnswer, Refused) as fault:
        down = MasterDown(
            f"no ROS master at {uri()} ({fault}): start roscore or launch a simulator,"
            " or mend ROS_MASTER_URI"
        )
        down.port_is_free = isinstance(fault, NobodyListens)
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


def living_address(name: str, timeout: float = TIMEOUT) -> str | None:
    """The XML-RPC address of the node of that full name; None if there is none that answers.

    Args:
        name: the node's.
        timeout: bound of each question [s]. Where a node was killed, nobody listens, which takes no time.

    Raises:
        NoAnswer: the master doesn't.
    """
    try:
        address = str(call("lookupNode", name))
    except Refused:
        return None
    if _answer(address, "getPid", timeout) is None:
        return None
    # A dead node's port may have been given to another one, even to one of that name at another master.
    theirs = _answer(address, "getMasterUri", timeout)
    if _answer(address, "getName", timeout) not in (None, name):
        return None
    return address if theirs is None or is_at(theirs) else None


def _answer(address: str, question: str, timeout: float) -> Any:
    """A node's answer; None if it has none, as roscpp's have for all but getPid."""
    try:
        return call_node(address, question, timeout=timeout)
    except (NoAnswer, Refused):
        return None
