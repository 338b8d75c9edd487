"""The addresses at which the processes of a launch listen, read from the kernel."""

import os
import socket
import time
import unittest
import xmlrpc.client
from pathlib import Path

import rosgraph

LISTENING = "0A"  # the state of a socket in /proc/net/tcp
LOOPBACK, EVERYWHERE = "127.0.0.1", "0.0.0.0"
BOUND = 60.0  # [s]


def pid_of(uri: str) -> int:
    """The process of a node or master."""
    with xmlrpc.client.ServerProxy(uri) as proxy:
        return int(proxy.getPid("/listening")[2])


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
        deadline = time.monotonic() + BOUND
        master = rosgraph.Master("/listening")
        while time.monotonic() < deadline:
            try:
                found = addresses(pid_of(master.lookupNode(name)))
                if len(found) == 2:
                    return found
            except rosgraph.MasterException:  # not registered yet
                pass
            time.sleep(0.1)
        raise self.failureException(f"{name} doesn't listen at two ports")

    def test_the_workspace_asks_for_loopback(self):
        self.assertEqual(os.environ["ROS_IP"], LOOPBACK)

    def test_the_master(self):
        """With roslaunch's own server, which is the same process here."""
        self.assertEqual(set(addresses(pid_of(rosgraph.get_master_uri()))), {LOOPBACK})

    def test_python(self):
        for name in ("/gazebo", "/joint_state_publisher"):
            self.assertEqual(self.node(name), [LOOPBACK, LOOPBACK], name)

    def test_roscpp(self):
        """XML-RPC, and TCPROS, which no setting keeps on loopback."""
        for name in ("/robot_state_publisher", "/manager"):
            self.assertEqual(self.node(name), [EVERYWHERE, LOOPBACK], name)
