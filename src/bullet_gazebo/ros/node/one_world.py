"""One world under one master: a node that takes another one's name ends it, which ROS does without a word."""

from urllib.parse import urlsplit

import rospy

from ros_calls import master
from ros_calls.master import NoAnswer, living_address

LIVING = 5.0  # [s] for an answer of one that is busy; of one that was killed nobody waits for it
MASTERS_REASON = "new node registered with same name"


class NameTaken(Exception):
    """A living node has the name; the text says which, and what to do."""


def refuse_twin(name: str) -> None:
    """Makes sure that no living node has that name.

    Raises:
        NameTaken: if one has.
    """
    try:
        address = living_address(name, LIVING)
    except NoAnswer:  # the master has gone meanwhile; rospy waits for it
        return
    if address is not None:
        raise NameTaken(
            f"{name} runs at {master.uri()} already ({address}): it stays, and this one ends. "
            f"Two simulators need two masters, for example ROS_MASTER_URI={_another_master()} before "
            "roslaunch; replace:=true (gzserver --replace) ends the one that runs"
        )


def _another_master() -> str:
    host, port = master.host_and_port()
    scheme = urlsplit(master.uri()).scheme or "http"
    return f"{scheme}://{host}:{port + 1 if port < 65535 else port - 1}"


class NameLoss:
    """Notices that another node takes this one's name, by which the master ends this one."""

    def __init__(self) -> None:
        self.happened = False
        rospy.core.add_preshutdown_hook(self._note)

    def _note(self, reason: str) -> None:
        self.happened = MASTERS_REASON in reason

    def text(self, name: str) -> str:
        """What happened, in one line."""
        return (
            f"another node has taken the name {name} at {master.uri()}, so this simulator ends. "
            f"Two simulators need two masters, for example ROS_MASTER_URI={_another_master()} before "
            "roslaunch"
        )
