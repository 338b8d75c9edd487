"""Whether a node lives that the master knows."""

import socket

import pytest

from ros_calls import nodes
from ros_calls.xmlrpc import NoAnswer


def test_a_node_that_answers_lives(master, other_master) -> None:
    assert nodes.living_address("/gazebo") is None
    master.nodes["/gazebo"] = other_master.uri
    assert nodes.living_address("/gazebo") == other_master.uri
    other_master.told.update(getName="/gazebo", getMasterUri=master.uri)
    assert nodes.living_address("/gazebo") == other_master.uri


def test_one_that_was_killed_does_not(master) -> None:
    with socket.socket() as reserved:  # bound only: connections are refused
        reserved.bind(("127.0.0.1", 0))
        master.nodes["/gazebo"] = f"http://127.0.0.1:{reserved.getsockname()[1]}"
        assert nodes.living_address("/gazebo") is None


def test_nor_does_one_that_says_nothing(master) -> None:
    with socket.create_server(("127.0.0.1", 0)) as deaf:
        master.nodes["/gazebo"] = f"http://127.0.0.1:{deaf.getsockname()[1]}"
        assert nodes.living_address("/gazebo", timeout=0.2) is None


@pytest.mark.parametrize(
    "told", [{"getName": "/talker"}, {"getName": "/gazebo", "getMasterUri": "http://127.0.0.1:1"}]
)
def test_its_port_may_belong_to_another_node_now(master, other_master, told) -> None:
    master.nodes["/gazebo"] = other_master.uri
    other_master.told.update(told)
    assert nodes.living_address("/gazebo") is None


def test_a_master_that_is_away_is_not_a_node_that_is(monkeypatch) -> None:
    monkeypatch.setenv("ROS_MASTER_URI", "http://127.0.0.1:1")
    with pytest.raises(NoAnswer):
        nodes.living_address("/gazebo")
