"""How the node begins, under which name, and how it ends that could not be made ready."""

import argparse
import contextlib
import threading
from types import SimpleNamespace
from unittest.mock import Mock

import pytest
import rospy

from bullet_gazebo.common.node_process import full_name, one_at_a_time
from bullet_gazebo.node import gzserver, node_name
from bullet_gazebo.node.node_name import NodeNameTaken, refuse_twin
from ros_calls import master


@pytest.fixture
def failing(monkeypatch):
    """A node whose registration fails, as it does where its master is gone."""

    def made(*_):
        raise ConnectionRefusedError("refused")

    signals = SimpleNamespace(noted=lambda: False)
    monkeypatch.setattr(gzserver, "GazeboNode", made)
    return lambda: gzserver.simulate(argparse.Namespace(), object(), signals)


PARTS = ("SceneServer", "WorldControl", "answer_xmlrpc", "free_polls_at_once", "bound_messages",
         "Reception", "hang_up_on_nonsense", "Thinner", "advertise_states",
         "PluginRegistry", "load_plugins", "_clock_frequency")  # fmt: skip


def test_no_model_is_spawned_before_all_services_are_there(monkeypatch):
    for name in PARTS:
        monkeypatch.setattr(gzserver, name, Mock())
    monkeypatch.setattr(gzserver, "registered_together", contextlib.nullcontext)
    gates = []

    def others(_):
        assert gates[0].locked()
        return ["all others"]

    monkeypatch.setattr(gzserver, "SpawnServices", lambda sim, plugins, gate: gates.append(gate) or Mock())
    monkeypatch.setattr(gzserver, "advertise_world_services", others)
    node = gzserver.GazeboNode.__new__(gzserver.GazeboNode)
    node.sim, node._watchdog, node.journal = SimpleNamespace(lockstep=False), Mock(), None
    node._advertise(True, argparse.Namespace(seed=0, camera_scale=1.0, renderer="rays"), of_world=[])
    assert node._services[-1] == "all others" and not gates[0].locked()


def test_a_master_that_goes_meanwhile_is_told_in_one_line(failing, nobody_listens, capsys):
    with master.using(nobody_listens):
        assert failing() == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"gzserver: the master at {nobody_listens}") and "went" in line


def test_what_fails_for_another_reason_is_raised(failing, monkeypatch):
    monkeypatch.setattr(master, "is_up", lambda: True)
    with pytest.raises(ConnectionRefusedError):
        failing()


def test_a_shutdown_meanwhile_is_none_of_its_faults(failing, monkeypatch, capsys):
    monkeypatch.setattr(rospy, "is_shutdown", lambda: True)
    assert failing() == 0
    assert capsys.readouterr().err == ""


BOUND = 60.0  # [s]


@pytest.mark.parametrize(
    ("line", "name"), [("", "/gazebo"), ("__name:=world -u", "/world"), ("__ns:=/second", "/second/gazebo")]
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
