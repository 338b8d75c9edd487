"""What an environment asks of the master before it becomes a node: no answer is an error that says so."""

import pytest

from robot_envs.backends.ros import node
from robot_envs.errors import RobotEnvError


def test_a_master_that_answers_knows_or_not(master):
    master.services["/a"] = "rosrpc://here:1"
    master.params.update({"/node": {"seed": 3}, "/number": 3})
    assert node.master_is_up()
    assert node.service_is_registered("/a")
    assert not node.service_is_registered("/b")
    assert node.private_parameters("/node") == {"seed": 3}
    assert node.private_parameters("/number") == node.private_parameters("/nobody") == {}


def test_where_a_master_could_be_started_there_are_no_parameters(nobody_listens, monkeypatch):
    monkeypatch.setenv("ROS_MASTER_URI", nobody_listens)
    assert not node.master_is_up()
    assert node.private_parameters("/node") == {}
    with pytest.raises(RobotEnvError, match=f"master at {nobody_listens}: Connection refused"):
        node.service_is_registered("/a")


def test_a_master_that_does_not_answer(nobody_answers, monkeypatch):
    monkeypatch.setenv("ROS_MASTER_URI", nobody_answers)
    for ask in (node.master_is_up, lambda: node.refuse_twin("/node")):
        with pytest.raises(RobotEnvError, match="no answer within"):
            ask()


def test_a_twin_is_refused_while_it_lives(master, nobody_listens):
    node.refuse_twin("/node")
    master.nodes["/node"] = nobody_listens  # registered by one that died
    node.refuse_twin("/node")
    master.nodes["/node"] = master.uri
    with pytest.raises(RobotEnvError, match="a node /node runs at"):
        node.refuse_twin("/node")
