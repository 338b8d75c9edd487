"""An environment that loses its simulator says what became of it."""

import socket

import pytest
import rospy

from robot_envs.backends.ros.running import RunningSimulator
from robot_envs.errors import SimulatorError, SimulatorHangs


@pytest.fixture
def master(master, monkeypatch):
    """Knows a simulator."""
    monkeypatch.setattr(rospy, "is_shutdown", lambda: False)
    master.nodes["/gazebo"] = master.uri
    return master


def fail(simulator, error):
    with simulator:
        raise error


def test_one_that_is_there_changes_no_error(master) -> None:
    running = RunningSimulator()
    assert running.is_registered()
    errors = SimulatorHangs("no answer"), SimulatorError("no"), rospy.ROSException("x"), KeyError()
    for error in errors:
        with pytest.raises(type(error)) as raised:
            fail(running, error)
        assert raised.value is error


def test_one_that_ended_changes_no_error(master) -> None:
    running = RunningSimulator()
    with socket.socket() as reserved:  # bound only: connections are refused
        reserved.bind(("127.0.0.1", 0))
        dead = f"http://127.0.0.1:{reserved.getsockname()[1]}"
        for address in (master.nodes.pop("/gazebo"), dead):
            if address != master.uri:
                master.nodes["/gazebo"] = address
            assert not running.is_registered()
            with pytest.raises(SimulatorError, match="^it broke$"):
                fail(running, SimulatorError("it broke"))


def test_another_one_in_its_place_is_told(master, other_master) -> None:
    running = RunningSimulator()
    master.nodes["/gazebo"] = other_master.uri
    assert not running.is_registered()
    words = "another one runs as /gazebo .* ROS_MASTER_URI .*model does not"
    with pytest.raises(SimulatorError, match=words):
        fail(running, SimulatorError("model does not exist"))


@pytest.mark.parametrize("error", [rospy.ROSException("publish() to a closed topic"), SimulatorError("x")])
def test_so_is_the_end_of_ones_own_node(master, monkeypatch, error) -> None:
    running = RunningSimulator()
    monkeypatch.setattr(rospy, "is_shutdown", lambda: True)
    with pytest.raises(SimulatorError, match="ROS node .* was shut down from outside"):
        fail(running, error)
