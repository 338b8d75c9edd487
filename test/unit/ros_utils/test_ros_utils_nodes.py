"""Whom ros_utils asks to shut down: nodes of the present master, never those of another one."""

import subprocess
import sys

import pytest

from ros_calls import master as ros_master
from ros_utils._internal import nodes as _nodes

OURS, THEIRS = "http://localhost:45678", "http://localhost:45679"
NODE = """
import os, sys
from xmlrpc.server import SimpleXMLRPCServer
server = SimpleXMLRPCServer(("127.0.0.1", 0), logRequests=False)
server.register_function(lambda caller: [1, "", os.getpid()], "getPid")
server.register_function(lambda caller, reason: print("shutdown", flush=True) or [1, "", 0], "shutdown")
if sys.argv[1] == "rospy":
    server.register_function(lambda caller: [1, "", os.environ["ROS_MASTER_URI"]], "getMasterUri")
print(server.server_address[1], flush=True)
server.serve_forever()
"""


@pytest.fixture
def start():
    """Starts what looks like a node from outside; returns its process and its address."""
    programs = []

    def start(kind, *arguments, master=OURS):
        program = subprocess.Popen(
            [sys.executable, "-c", NODE, kind, *arguments], env={"ROS_MASTER_URI": master},
            stdout=subprocess.PIPE, text=True,
        )  # fmt: skip
        programs.append(program)
        return program, f"http://127.0.0.1:{program.stdout.readline().strip()}"

    yield start
    for program in programs:
        program.kill()
        program.communicate()


@pytest.mark.parametrize("kind", ["rospy", "roscpp"])
def test_a_node_of_the_master_is_asked(start, kind):
    program, address = start(kind, master=OURS.replace("localhost", "127.0.0.1") + "/")
    with ros_master.using(OURS):
        assert _nodes.ask_to_shut_down(address)
    assert program.stdout.readline() == "shutdown\n"


@pytest.mark.parametrize(
    ("kind", "arguments", "master"),
    [("rospy", (), THEIRS), ("roscpp", (), THEIRS), ("roscpp", (f"__master:={THEIRS}",), OURS)],
)
def test_a_node_of_another_master_on_a_reused_port_is_left_alone(start, kind, arguments, master):
    program, address = start(kind, *arguments, master=master)
    with ros_master.using(OURS):
        assert not _nodes.ask_to_shut_down(address)
    program.kill()
    assert program.stdout.read() == ""


def test_nobody_there():
    with ros_master.using(OURS):
        assert not _nodes.ask_to_shut_down("http://127.0.0.1:9")


@pytest.mark.parametrize(
    ("address", "same"),
    [
        ("http://127.0.0.1:45678/", True),
        ("http://localhost:45679", False),
        ("http://203.0.113.1:45678", False),  # another machine, same port
        ("nonsense", False),
        ("http://localhost:nonsense", False),
    ],
)
def test_one_master_has_many_names(address, same):
    with ros_master.using(OURS):
        assert ros_master.is_at(address) is same
