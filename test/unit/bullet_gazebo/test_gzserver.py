"""How the node ends that could not be made ready."""

import argparse
import contextlib
import socket
from types import SimpleNamespace
from unittest.mock import Mock

import pytest
import rospy

from bullet_gazebo.node import gzserver
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

    monkeypatch.setattr(
        gzserver, "SpawnServices", lambda sim, plugins, gate: gates.append(gate) or Mock()
    )
    monkeypatch.setattr(gzserver, "advertise_world_services", others)
    node = gzserver.GazeboNode.__new__(gzserver.GazeboNode)
    node.sim, node._watchdog, node.journal = SimpleNamespace(lockstep=False), Mock(), None
    node._advertise(
        True, argparse.Namespace(seed=0, camera_scale=1.0, renderer="rays"), of_world=[]
    )
    assert node._services[-1] == "all others" and not gates[0].locked()


def test_a_master_that_goes_meanwhile_is_told_in_one_line(failing, capsys):
    with socket.socket() as reserved:  # bound, and nobody listens
        reserved.bind(("127.0.0.1", 0))
        uri = f"http://127.0.0.1:{reserved.getsockname()[1]}"
        with master.using(uri):
            assert failing() == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"gzserver: the master at {uri}") and "went" in line


def test_what_fails_for_another_reason_is_raised(failing, monkeypatch):
    monkeypatch.setattr(master, "is_up", lambda: True)
    with pytest.raises(ConnectionRefusedError):
        failing()


def test_a_shutdown_meanwhile_is_none_of_its_faults(failing, monkeypatch, capsys):
    monkeypatch.setattr(rospy, "is_shutdown", lambda: True)
    assert failing() == 0
    assert capsys.readouterr().err == ""
