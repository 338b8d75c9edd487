"""The node's name at the master: refused to a second simulator, and lost to one that replaces this one."""

from urllib.parse import urlsplit

import rospy

from ros_calls import master
from ros_calls.master import NoAnswer, living_address

LIVING = 5.0  # [s] for an answer of a busy node; that of a killed one comes at once
MASTERS_REASON = "new node registered with same name"


class NodeNameTaken(Exception):
    """A living node has the name; the text says which, and what to do."""


def refuse_twin(name: str) -> None:
    """Raises NodeNameTaken if a living node has that name: registering would end that node silently."""
    try:
        address = living_address(name, LIVING)
    except NoAnswer:  # the master has gone meanwhile; rospy waits for it
        return
    if address is not None:
        raise NodeNameTaken(
            f"{name} runs at {master.uri()} already ({address}): it stays, and this one ends. "
            f"{_two_masters()}; replace:=true (gzserver --replace) ends the one that runs"
        )


def _two_masters() -> str:
    host, port = master.host_and_port()
    scheme = urlsplit(master.uri()).scheme or "http"
    another = f"{scheme}://{host}:{port + 1 if port < 65535 else port - 1}"
    return f"Two simulators need two masters, for example ROS_MASTER_URI={another} before roslaunch"


class NameLoss:
    """Notices that the master ends this node because another one takes its name."""

    def __init__(self) -> None:
        self.happened = False
        rospy.core.add_preshutdown_hook(self._note)

    def _note(self, reason: str) -> None:
        self.happened = MASTERS_REASON in reason

    def text(self, name: str) -> str:
        """Returns what happened, in one line."""
        return (
            f"another node has taken the name {name} at {master.uri()}, so this simulator ends. "
            f"{_two_masters()}"
        )
