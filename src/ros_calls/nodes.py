"""Whether a node lives that the master knows: one that was killed stays registered."""

from __future__ import annotations

from typing import Any

from ros_calls import master, xmlrpc
from ros_calls.xmlrpc import NoAnswer, Refused


def living_address(name: str, timeout: float = xmlrpc.TIMEOUT) -> str | None:
    """The XML-RPC address of the node of that full name; None if there is none that answers.

    Args:
        name: the node's.
        timeout: bound of each question [s]. Where a node was killed, nobody listens, which takes no time.

    Raises:
        NoAnswer: the master doesn't.
    """
    try:
        address = str(master.call("lookupNode", name))
    except Refused:
        return None
    if _told(address, "getPid", timeout) is None:
        return None
    # A dead node's port may have been given to another one, even to one of that name at another master.
    theirs = _told(address, "getMasterUri", timeout)
    if _told(address, "getName", timeout) not in (None, name):
        return None
    return address if theirs is None or master.is_at(theirs) else None


def _told(address: str, question: str, timeout: float) -> Any:
    """A node's answer; None if it has none, as roscpp's have for all but getPid."""
    try:
        return xmlrpc.call(address, question, timeout=timeout)
    except (NoAnswer, Refused):
        return None
