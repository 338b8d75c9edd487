"""The node's name at the master: who is refused, and who waits."""

from __future__ import annotations

import threading

import pytest

from bullet_gazebo.common.node_process import full_name, one_at_a_time
from bullet_gazebo.node import node_name
from bullet_gazebo.node.node_name import NodeNameTaken, refuse_twin

BOUND = 60.0  # [s]


@pytest.mark.parametrize(
    ("line", "name"),
    [("", "/gazebo"), ("__name:=world -u", "/world"), ("__ns:=/second", "/second/gazebo")],
)
def test_the_name_is_the_command_lines(line, name, monkeypatch) -> None:
    monkeypatch.delenv("ROS_NAMESPACE", raising=False)
    assert full_name(["gzserver", *line.split()], "gazebo") == name


def test_a_twin_is_refused_while_it_lives_with_a_way_out(master) -> None:
    refuse_twin("/gazebo")
    master.nodes["/gazebo"] = "http://127.0.0.1:1"  # killed
    refuse_twin("/gazebo")
    master.nodes["/gazebo"] = master.uri
    way_out = "/gazebo runs at .* ROS_MASTER_URI=http://127.0.0.1:.* replace:=true"
    with pytest.raises(NodeNameTaken, match=way_out):
        refuse_twin("/gazebo")


def test_two_of_a_name_start_one_after_the_other(master) -> None:
    inside, order = threading.Event(), []

    def start() -> None:
        with one_at_a_time("/gazebo", BOUND):
            inside.set()
            order.append("second")

    with one_at_a_time("/gazebo"):
        other = threading.Thread(target=start)
        other.start()
        with one_at_a_time("/another", BOUND):
            assert not inside.wait(0.2)
        order.append("first")
    other.join(BOUND)
    assert order == ["first", "second"]


def test_one_that_never_comes_up_holds_up_nobody_for_ever(master) -> None:
    with one_at_a_time("/gazebo"), one_at_a_time("/gazebo", bound=0.1):
        pass


def test_the_loss_of_the_name_is_told_apart_from_other_ends(master, monkeypatch) -> None:
    hooks = []
    monkeypatch.setattr(node_name.rospy.core, "add_preshutdown_hook", hooks.append)
    loss = node_name.NameLoss()
    request = "external shutdown request from [{}]: [{}]"
    hooks[0](request.format("/rosnode", "user request"))
    assert not loss.happened
    hooks[0](request.format("master", "[/gazebo] Reason: new node registered with same name"))
    assert loss.happened
    assert "another node has taken the name /gazebo" in loss.text("/gazebo")
