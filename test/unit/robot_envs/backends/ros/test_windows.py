"""What is said of the simulator's window: where it is, that it is open, or that it didn't open."""

import threading

import pytest
import rospy

from robot_envs.backends.ros import windows

NODE = "/gazebo_gui"
WHERE = "the window is the page http://127.0.0.1:8080/"


@pytest.fixture
def master(master, monkeypatch):
    monkeypatch.setattr(rospy, "is_shutdown", lambda: False)
    for kept in ("_master_proxy", "_param_server"):  # of another test's master
        monkeypatch.setattr(rospy.client, kept, None)
    return master


@pytest.fixture
def said():
    return []


def test_one_that_tells_nobody_its_address_is_not_waited_for(master, said):
    assert not windows.is_open()
    master.nodes[NODE] = master.uri
    assert windows.is_open()
    windows.report_open(said.append)
    (line,) = said
    assert "open already" in line


def test_one_that_is_open_tells_where(master, said):
    master.params[windows.WINDOW] = [WHERE]
    windows.report_open(said.append)
    assert said == [WHERE]


def test_one_that_opens_is_waited_for(master, said):
    master.nodes[NODE] = master.uri
    telling = threading.Thread(target=windows.report_opening, args=(said.append, False))
    telling.start()
    master.params[windows.WINDOW] = [WHERE]
    telling.join()
    assert said == [WHERE]


def test_one_that_has_ended_is_waited_for_no_longer(master, said, monkeypatch):
    monkeypatch.setattr(windows, "TIMEOUT", float("inf"))
    windows.report_opening(said.append, registered=True)
    master.nodes[NODE] = master.uri
    telling = threading.Thread(target=windows.report_opening, args=(said.append, False))
    telling.start()
    asked = len(master.questions)
    while master.questions[asked:].count(NODE) == 0:
        threading.Event().wait(0.01)
    del master.nodes[NODE]
    telling.join()
    assert said == ["the window didn't open; the log of gazebo_gui says why"] * 2
