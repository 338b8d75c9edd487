"""Nodes of a ROS master: queries and shutdown; every call has a time limit."""

import contextlib
import time
from urllib.parse import urlsplit

import psutil
import rospy

from ros_calls import master as _master
from ros_calls.master import NoAnswer, NobodyListens, Refused, answer, call_node, call_plain
from ros_calls.waiting import POLL

CORE_NODES = ("/rosout",)  # starts and ends with the master


def node_names() -> list[str]:
    """Returns the sorted names of all registered nodes; empty without a master."""
    state = answer(_master.uri(), "getSystemState") or ()
    return sorted({node for kind in state for _, nodes in kind for node in nodes})


def node_uri(name: str) -> str | None:
    """Returns a node's XML-RPC address, or None if the master doesn't know it or is down."""
    address: str | None = answer(_master.uri(), "lookupNode", name)
    return address


def node_uris() -> dict[str, str]:
    """Returns the XML-RPC addresses of all registered nodes, by name."""
    uris = {name: node_uri(name) for name in node_names()}
    return {name: address for name, address in uris.items() if address}


def node_pid(address: str) -> int | None:
    """Returns the process id of the node at an XML-RPC address, or None if it doesn't answer."""
    pid: int | None = answer(address, "getPid", timeout=1.0)
    return pid


def is_own(address: str) -> bool:
    """Returns True if the XML-RPC address is this process's own node's."""
    return bool(rospy.core.is_initialized()) and address == rospy.core.get_node_uri()


def _master_of(address: str) -> str | None:
    """Returns the address of a node's master, or None if it can't be found out.

    roscpp nodes have no method for it, so the answer comes from what their process was started with.
    """
    uri: str | None = answer(address, "getMasterUri", timeout=1.0)
    if uri is not None:
        return uri
    host = urlsplit(address).hostname
    pid = node_pid(address) if host and _master.host_is_local(host) else None
    return _started_with(pid) if pid else None


def _started_with(pid: int) -> str | None:
    """Returns the master that a process was started with; None if not given, or another user's process."""
    try:
        process = psutil.Process(pid)
        given = [each for each in process.cmdline() if each.startswith("__master:=")]
        if given:
            return given[0].removeprefix("__master:=")
        return process.environ().get("ROS_MASTER_URI")
    except psutil.Error:
        return None


def ask_to_shut_down(address: str) -> bool:
    """Asks the node at an XML-RPC address to shut itself down, as rosnode kill does.

    Returns False if no one listens there, or a node of another master, which got a dead node's port.
    """
    theirs = _master_of(address)
    if theirs is not None and not _master.is_at(theirs):
        return False
    try:
        call_node(address, "shutdown", "asked by ros_utils")
    except (NobodyListens, Refused):
        return False
    except NoAnswer:
        pass  # a node may close the connection before it has answered
    return True


def shut_down_nodes(nodes: dict[str, str], timeout: float = 5.0) -> list[str]:
    """Shuts down nodes, given by name and XML-RPC address, but not the caller's own and rosout.

    Returns the names that are still registered after `timeout` [s].
    """
    asked = {
        name: address for name, address in nodes.items() if name not in CORE_NODES and not is_own(address)
    }
    for address in asked.values():
        ask_to_shut_down(address)
    deadline = time.monotonic() + timeout
    # Not wait_until(): it ends once the caller's own node has shut down.
    while asked and time.monotonic() < deadline:
        for name, address in list(asked.items()):
            try:
                call_node(address, "getPid", timeout=1.0)
            except NobodyListens:
                _unregister(name, address)
            except (NoAnswer, Refused):
                pass
        # Not by lookupNode: it also knows nodes of which only a parameter subscription is left
        asked = {name: asked[name] for name in node_names() if name in asked}
        if asked:
            time.sleep(POLL)
    return list(asked)


def _unregister(name: str, address: str) -> None:
    """Unregisters a dead node at the master, as rosnode cleanup does.

    A rospy node that is asked to shut down often exits before it has unregistered itself.
    """
    with contextlib.suppress(NoAnswer, Refused):
        publishers, subscribers, services = _master.call("getSystemState")
        kinds = (("unregisterPublisher", publishers), ("unregisterSubscriber", subscribers))
        for method, topics in kinds:
            for topic in (topic for topic, nodes in topics if name in nodes):
                call_plain(_master.uri(), method, name, topic, address)
        for service in (service for service, nodes in services if name in nodes):
            location = _master.call("lookupService", service)
            call_plain(_master.uri(), "unregisterService", name, service, location)
