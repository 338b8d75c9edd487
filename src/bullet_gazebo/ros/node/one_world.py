"""One world under one master: a node that takes another one's name ends it, which ROS does without a word."""

import contextlib
import hashlib
import socket
from collections.abc import Iterator, Sequence
from urllib.parse import urlsplit

import rosgraph
import rospy

from ros_calls import master
from ros_calls.nodes import living_address
from ros_calls.waiting import wait_until
from ros_calls.xmlrpc import NoAnswer

LIVING = 5.0  # [s] for an answer of one that is busy; of one that was killed nobody waits for it
STARTING = 20.0  # [s] for another one to become a node
MASTERS_REASON = "new node registered with same name"


class NameTaken(Exception):
    """A living node has the name; the text says which, and what to do."""


def full_name(command_line: Sequence[str], default: str) -> str:
    """A node's name with its namespace, before it is one."""
    arguments = list(command_line)
    own = rosgraph.names.load_mappings(arguments).get("__name", default)
    return str(rosgraph.names.ns_join(rosgraph.names.get_ros_namespace(argv=arguments), own))


@contextlib.contextmanager
def one_at_a_time(name: str, bound: float = STARTING) -> Iterator[None]:
    """In the block no other process of this machine becomes a node of that name at the master's port.

    Two that do at once end each other: each one's registrations are news of another node to the master.

    Args:
        name: the node's.
        bound: of the wait for others [s]; then it goes on all the same.
    """
    key = hashlib.sha256(f"{master.host_and_port()[1]} {name}".encode()).hexdigest()
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as lock:

        def get() -> bool:
            try:
                lock.bind(
                    f"\0bullet_gazebo {key}"
                )  # a name in the kernel: it goes with the process
            except OSError:
                return False
            return True

        wait_until(get, bound, f"another {name} to come up")
        yield


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
