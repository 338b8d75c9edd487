"""A node's name before it is one, and one process at a time that takes it."""

import contextlib
import hashlib
import socket
from collections.abc import Iterator, Sequence

import rosgraph

from ros_calls import master
from ros_calls.waiting import wait_until

STARTING = 20.0  # [s] for another one to become a node


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
