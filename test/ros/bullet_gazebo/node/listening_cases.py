"""The addresses at which the processes of a launch listen, read from the kernel."""

import os
import socket
import unittest
from pathlib import Path

import rosgraph
from support.ros.calls import process_of, wait_until

LISTENING = "0A"  # the state of a socket in /proc/net/tcp
LOOPBACK, EVERYWHERE = "127.0.0.1", "0.0.0.0"


def addresses(pid: int) -> list[str]:
    """Where a process accepts TCP connections: one address for each port."""
    sockets = set()
    for link in Path(f"/proc/{pid}/fd").iterdir():
        try:
            sockets.add(os.readlink(link))
        except FileNotFoundError:  # closed meanwhile
            continue
    found = []
    for table in ("tcp", "tcp6"):
        for line in Path(f"/proc/{pid}/net/{table}").read_text().splitlines()[1:]:
            fields = line.split()
            if fields[3] == LISTENING and f"socket:[{fields[9]}]" in sockets:
                found.append(_readable(fields[1].split(":")[0]))
    return sorted(found)


def _readable(number: str) -> str:
    if len(number) == 8:
        return socket.inet_ntoa(bytes.fromhex(number)[::-1])
    return number


class Listening(unittest.TestCase):
    def node(self, name: str) -> list[str]:
        """A node's addresses, once it has both of its ports."""

        def look() -> list[str]:
            pid = process_of(name)
            return addresses(pid) if pid else []

        found = wait_until(lambda: len(seen := look()) == 2 and seen)
        self.assertTrue(found, f"{name} doesn't listen at two ports")
        return found

    def test_the_workspace_asks_for_loopback(self):
        self.assertEqual(os.environ["ROS_IP"], LOOPBACK)

    def test_the_master(self):
        """With roslaunch's own server, which is the same process here."""
        self.assertEqual(set(addresses(rosgraph.Master("/listening").getPid())), {LOOPBACK})

    def test_python(self):
        for name in ("/gazebo", "/joint_state_publisher"):
            self.assertEqual(self.node(name), [LOOPBACK, LOOPBACK], name)

    def test_roscpp(self):
        """XML-RPC, and TCPROS, which no setting keeps on loopback."""
        for name in ("/robot_state_publisher", "/manager"):
            self.assertEqual(self.node(name), [EVERYWHERE, LOOPBACK], name)
