"""Calls of the ROS master and of nodes, with a time limit.

rospy's own XML-RPC proxies have none: on a dead network they block for minutes. rospy also knows one master
per process; here each thread can switch to another one for a while.
"""

import contextlib
import functools
import http.client
import socket
import xmlrpc.client
from collections.abc import Iterator
from contextvars import ContextVar
from typing import Any
from urllib.parse import urlsplit
from xml.parsers.expat import ExpatError

import rosgraph

CALLER = "/ros_calls"  # caller name for the other side's records; nothing depends on it
TIMEOUT = 2.0  # [s] for one call of a master or node; a live one answers in milliseconds

_chosen: ContextVar[str | None] = ContextVar("ros_master", default=None)


class NoAnswer(Exception):
    """Nothing usable came back; the text says why."""


class NobodyListens(NoAnswer):
    """The connection was refused."""


class BadAnswer(NoAnswer):
    """The answer doesn't follow ROS's protocol, or the method is unknown."""


class Refused(Exception):
    """The other side answered with an error."""


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
    """As `call_plain`, with the caller's name in front, which masters and nodes expect."""
    return call_plain(uri, method, CALLER, *args, timeout=timeout)


def call_plain(uri: str, method: str, *args: Any, timeout: float = TIMEOUT) -> Any:
    """Calls an XML-RPC method that answers in ROS's form, ``[code, text, value]``; returns the value.

    `timeout` limits connecting, sending and each part of the answer [s of wall time]. Raises NoAnswer if
    nothing usable came back, Refused if the answer's code is not 1.
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
        http.client.HTTPException, xmlrpc.client.Error, ExpatError, TypeError, ValueError,
    ) as fault:  # fmt: skip
        raise BadAnswer(f"an answer that is not ROS's: {type(fault).__name__}") from fault
    if code != 1:
        raise Refused(text)
    return value


class MasterDown(Exception):
    """No ROS master can be used; the text gives its address and what to do."""

    port_is_free = False  # no one listens there, so a master could be started


def uri() -> str:
    """Returns the master's address: from `using`, else ``__master:=``, else ROS_MASTER_URI."""
    return _chosen.get() or str(rosgraph.get_master_uri())


@contextlib.contextmanager
def using(master_uri: str | None) -> Iterator[None]:
    """Returns a block in which this thread's calls go to another master; None changes nothing.

    The environment stays unchanged, so the rest of the process is unaffected.
    """
    token = _chosen.set(master_uri or _chosen.get())
    try:
        yield
    finally:
        _chosen.reset(token)


def call(method: str, *args: Any, timeout: float = TIMEOUT) -> Any:
    """Calls a method of the master; raises as `call_plain`."""
    return call_node(uri(), method, *args, timeout=timeout)


def require(timeout: float = TIMEOUT) -> None:
    """Raises MasterDown, which says why, unless the master answers within `timeout` [s]."""
    host_and_port()
    try:
        call("getPid", timeout=timeout)
    except (NoAnswer, Refused) as fault:
        down = MasterDown(
            f"no ROS master at {uri()} ({fault}): start roscore or launch a simulator, or mend ROS_MASTER_URI"
        )
        down.port_is_free = isinstance(fault, NobodyListens)
        raise down from fault


def is_up_or_startable() -> bool:
    """Returns True if the master answers, False if none does but one can be started there.

    Raises MasterDown if another machine doesn't answer, or another program holds the port: roslaunch would
    wait for minutes.
    """
    try:
        require()
    except MasterDown as down:
        if not host_is_local(host_and_port()[0]):
            raise
        if not down.port_is_free:
            raise MasterDown(
                f"{uri()}: the port is in use, and not by a ROS master ({down.__cause__}):"
                " set ROS_MASTER_URI to a free port"
            ) from down
        return False
    return True


def is_up() -> bool:
    """Returns True if the master answers."""
    with contextlib.suppress(MasterDown):
        require()
        return True
    return False


def host_and_port() -> tuple[str, int]:
    """Returns host and port of the master; raises MasterDown if ROS_MASTER_URI isn't an address."""
    try:
        parts = urlsplit(uri())
        host, port = parts.hostname, parts.port
    except ValueError:
        host = port = None
    if not host or not port:
        raise MasterDown(f"ROS_MASTER_URI is {uri()!r}: expected something like http://localhost:11311")
    return host, port


@functools.cache  # the look-up may ask a name server
def host_is_local(host: str) -> bool:
    """Returns True if any name of this machine matches the host."""
    return host == "localhost" or host.startswith("127.") or bool(rosgraph.network.is_local_address(host))


def is_at(address: str) -> bool:
    """Returns True if an address is the current master's, under any name of its host."""
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
    """Returns the XML-RPC address of a node, None if it doesn't answer; raises NoAnswer without a master."""
    try:
        address = str(call("lookupNode", name))
    except Refused:
        return None
    if answer(address, "getPid", timeout=timeout) is None:
        return None
    # Another node may have a dead node's port by now, even one of the same name at another master.
    theirs = answer(address, "getMasterUri", timeout=timeout)
    if answer(address, "getName", timeout=timeout) not in (None, name):
        return None
    return address if theirs is None or is_at(theirs) else None


def lives(name: str) -> bool:
    """Returns whether a node answers; a killed one stays registered."""
    try:
        return living_address(name) is not None
    except NoAnswer:  # of the master
        return False


def answer(address: str, method: str, *args: Any, timeout: float = TIMEOUT) -> Any:
    """Returns the answer of a node or master, or None; roscpp nodes answer only getPid."""
    try:
        return call_node(address, method, *args, timeout=timeout)
    except (NoAnswer, Refused):
        return None
