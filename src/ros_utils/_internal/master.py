"""The ROS master, each question with a time limit.

rospy's own master proxy has no time limit: a master behind a dead network hangs its callers for
minutes.
"""

from __future__ import annotations

import functools
import http.client
import socket
import xmlrpc.client
from typing import Any
from urllib.parse import urlsplit
from xml.parsers.expat import ExpatError

import rosgraph

from ros_utils._internal import target as _target

CALLER = "/ros_utils"
TIMEOUT = 2.0  # [s] for one question to the master or a node; a live one answers in milliseconds
POLL = 0.05  # [s] between two looks at something that is being waited for


class NoAnswer(Exception):
    """Nothing usable came back: nobody listens, no answer in time, or somebody else answers."""


class Refused(Exception):
    """The other side answered, and its answer is no."""


class MasterDown(Exception):
    """No ROS master can be used; the text says where it was looked for and what to do."""

    port_is_free = False  # nobody listens there, so a master could be started


class _Transport(xmlrpc.client.Transport):
    """XML-RPC over HTTP with a time limit on every socket operation."""

    def __init__(self, timeout: float):
        super().__init__()
        self._timeout = timeout

    def make_connection(self, host: Any) -> http.client.HTTPConnection:
        connection = super().make_connection(host)
        connection.timeout = self._timeout
        return connection


def call(uri: str, method: str, *args: Any, timeout: float = TIMEOUT) -> Any:
    """Ask a master or node and return the value of its answer. See `call_plain`."""
    return call_plain(uri, method, CALLER, *args, timeout=timeout)


def call_plain(uri: str, method: str, *args: Any, timeout: float = TIMEOUT) -> Any:
    """Ask something that answers in ROS's way, ``[code, text, value]``, and return the value.

    Masters and nodes want the caller's name as first argument (see `call`); roslaunch doesn't.

    Raises:
        NoAnswer: nobody answers at `uri` within `timeout` [s], or not in ROS's way.
        Refused: the answer's code is not 1.
    """
    try:
        with xmlrpc.client.ServerProxy(uri, transport=_Transport(timeout)) as proxy:
            code, text, value = getattr(proxy, method)(*args)
    except TimeoutError as fault:
        raise NoAnswer(f"no answer within {timeout:g} s") from fault
    except OSError as fault:
        raise NoAnswer(fault.strerror or str(fault)) from fault
    except (
        http.client.HTTPException,
        xmlrpc.client.Error,
        ExpatError,
        TypeError,
        ValueError,
    ) as fault:
        raise NoAnswer(f"an answer that is not ROS's: {type(fault).__name__}") from fault
    if code != 1:
        raise Refused(text)
    return value


def uri() -> str:
    """The master's address. See `_target`."""
    return _target.uri()


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


def require() -> None:
    """Return if the master answers.

    Raises:
        MasterDown: it doesn't, with the reason.
    """
    host_and_port()
    try:
        call(uri(), "getPid")
    except (NoAnswer, Refused) as fault:
        down = MasterDown(
            f"no ROS master at {uri()} ({fault}): start roscore or launch_Gazebo,"
            " or mend ROS_MASTER_URI"
        )
        down.port_is_free = isinstance(fault.__cause__, ConnectionRefusedError)
        raise down from fault


def is_up() -> bool:
    """True if the master answers."""
    try:
        require()
    except MasterDown:
        return False
    return True
