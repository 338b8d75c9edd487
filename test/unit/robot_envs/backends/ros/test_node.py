"""What an environment asks of the master before it becomes a node: no answer is an error that says so."""

import socket

import pytest

from robot_envs.backends.ros import node
from robot_envs.errors import RobotEnvError


@pytest.fixture
def nobody(monkeypatch):
    """A master address where nobody listens."""
    with socket.socket() as reserved:  # bound only: connections are refused
        reserved.bind(("127.0.0.1", 0))
        uri = f"http://127.0.0.1:{reserved.getsockname()[1]}"
        monkeypatch.setenv("ROS_MASTER_URI", uri)
        yield uri


@pytest.fixture
def deaf(monkeypatch):
    """An address where somebody listens and never answers."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        uri = f"http://127.0.0.1:{server.getsockname()[1]}"
        monkeypatch.setenv("ROS_MASTER_URI", uri)
        yield uri


def test_a_master_that_answers_knows_or_not(master):
    master.services["/a"] = "rosrpc://here:1"
    master.params.update({"/node": {"seed": 3}, "/number": 3})
    assert node.master_is_up()
    assert node.service_is_registered("/a")
    assert not node.service_is_registered("/b")
    assert node.private_parameters("/node") == {"seed": 3}
    assert node.private_parameters("/number") == node.private_parameters("/nobody") == {}


def test_where_a_master_could_be_started_there_are_no_parameters(nobody):
    assert not node.master_is_up()
    assert node.private_parameters("/node") == {}
    with pytest.raises(RobotEnvError, match=f"the ROS master at {nobody}: Connection refused"):
        node.service_is_registered("/a")


def test_a_master_that_does_not_answer(deaf):
    for ask in (node.master_is_up, lambda: node.refuse_twin("/node")):
        with pytest.raises(RobotEnvError, match="no answer within"):
            ask()


def test_a_twin_is_refused_while_it_lives(master, nobody, monkeypatch):
    monkeypatch.setenv("ROS_MASTER_URI", master.uri)
    node.refuse_twin("/node")
    master.nodes["/node"] = nobody  # registered by one that died
    node.refuse_twin("/node")
    master.nodes["/node"] = master.uri
    with pytest.raises(RobotEnvError, match="a node /node runs at"):
        node.refuse_twin("/node")
