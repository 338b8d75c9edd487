"""How the node ends that could not be made ready."""

import argparse
import socket
from types import SimpleNamespace

import pytest
import rospy

from bullet_gazebo.ros.node import gzserver
from ros_calls import master


@pytest.fixture
def failing(monkeypatch):
    """A node whose registration fails, as it does where its master is gone."""

    def made(*_):
        raise ConnectionRefusedError("refused")

    signals = SimpleNamespace(noted=lambda: False)
    monkeypatch.setattr(gzserver, "GazeboNode", made)
    return lambda: gzserver.simulate(argparse.Namespace(), object(), signals)


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
