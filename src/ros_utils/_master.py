"""The ROS master and the nodes registered at it, each question with a time limit.

rospy's own master proxy has no time limit: a master behind a dead network hangs its callers for
minutes.
"""

from __future__ import annotations

import contextlib
import functools
import http.client
import time
import xmlrpc.client
from typing import Any
from urllib.parse import urlsplit
from xml.parsers.expat import ExpatError

import rosgraph
import rospy

from ros_utils import _target

CALLER = "/ros_utils"
TIMEOUT = 2.0  # [s] for one question to the master or a node; a live one answers in milliseconds
POLL = 0.05  # [s] between two looks at something that is being waited for
CORE_NODES = ("/rosout",)  # lives and dies with the master


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
    return _host_is_local(host_and_port()[0])


@functools.cache  # may ask a name server
def _host_is_local(host: str) -> bool:
    return (
        host == "localhost"
        or host.startswith("127.")
        or bool(rosgraph.network.is_local_address(host))
    )


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


def node_names() -> list[str]:
    """Names of all registered nodes, sorted; empty without a master."""
    try:
        state = call(uri(), "getSystemState")
    except (NoAnswer, Refused):
        return []
    return sorted({node for kind in state for _, nodes in kind for node in nodes})


def node_uri(name: str) -> str | None:
    """The XML-RPC address of a node, or None if the master doesn't know it (or is down)."""
    try:
        return str(call(uri(), "lookupNode", name))
    except (NoAnswer, Refused):
        return None


def node_uris() -> dict[str, str]:
    """Name and XML-RPC address of all registered nodes."""
    found = {name: node_uri(name) for name in node_names()}
    return {name: address for name, address in found.items() if address}


def node_pid(address: str) -> int | None:
    """The process id of the node at an XML-RPC address, or None if it doesn't answer."""
    try:
        return int(call(address, "getPid", timeout=1.0))
    except (NoAnswer, Refused):
        return None


def is_own(address: str) -> bool:
    """True if the XML-RPC address is the calling process's own node."""
    return bool(rospy.core.is_initialized()) and address == rospy.core.get_node_uri()


def _belongs_to_other_master(address: str) -> bool:
    """True if the node says that its master is another one.

    A dead node's port may have been given to a node of somebody else's master. roscpp nodes don't
    offer the question.
    """
    try:
        theirs = urlsplit(str(call(address, "getMasterUri", timeout=1.0)))
        return theirs.port != host_and_port()[1]
    except (NoAnswer, Refused, ValueError, MasterDown):
        return False


def ask_to_shut_down(address: str) -> bool:
    """Ask the node at an XML-RPC address to shut itself down, as rosnode kill does.

    Returns:
        False if nobody listens there or the node belongs to another master.
    """
    if _belongs_to_other_master(address):
        return False
    try:
        call(address, "shutdown", "asked by ros_utils")
    except NoAnswer as fault:
        # A node may close the connection before it has answered: only an address without listener
        # is a failure.
        return not isinstance(fault.__cause__, ConnectionRefusedError)
    except Refused:
        return False
    return True


def shut_down_nodes(nodes: dict[str, str], timeout: float = 5.0) -> list[str]:
    """Ask nodes to shut down and wait until the master has forgotten them.

    The caller's own node and rosout are left alone.

    Args:
        nodes: name and XML-RPC address.
        timeout: bound of the wait for all of them [s].

    Returns:
        The names that are still registered afterwards.
    """
    asked = {
        name: address
        for name, address in nodes.items()
        if name not in CORE_NODES and not is_own(address)
    }
    for address in asked.values():
        ask_to_shut_down(address)
    deadline = time.monotonic() + timeout
    while asked and time.monotonic() < deadline:
        for name, address in list(asked.items()):
            if _is_dead(address):
                _unregister(name, address)
        # lookupNode isn't asked: it also knows nodes of which nothing but a parameter watch is left
        asked = {name: asked[name] for name in node_names() if name in asked}
        if asked:
            time.sleep(POLL)
    return list(asked)


def _is_dead(address: str) -> bool:
    """True if nobody listens at a node's XML-RPC address any more."""
    try:
        call(address, "getPid", timeout=1.0)
    except NoAnswer as fault:
        return isinstance(fault.__cause__, ConnectionRefusedError)
    except Refused:
        pass
    return False


def _unregister(name: str, address: str) -> None:
    """Have the master forget a dead node, as rosnode cleanup does.

    A rospy node that is asked to shut down often exits before it has taken its leave of the master.
    """
    with contextlib.suppress(NoAnswer, Refused):
        publishers, subscribers, services = call(uri(), "getSystemState")
        kinds = (("unregisterPublisher", publishers), ("unregisterSubscriber", subscribers))
        for method, topics in kinds:
            for topic in (topic for topic, nodes in topics if name in nodes):
                call_plain(uri(), method, name, topic, address)
        for service in (service for service, nodes in services if name in nodes):
            location = call(uri(), "lookupService", service)
            call_plain(uri(), "unregisterService", name, service, location)
