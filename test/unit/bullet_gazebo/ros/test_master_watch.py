"""A master that is gone, or another one than we registered with: told once, and registered there."""

from __future__ import annotations

import pytest
import rospy
from support.ros.ros_fakes import FakeMaster

from bullet_gazebo.ros.node import master_watch
from bullet_gazebo.ros.node.master_watch import MasterWatch
from ros_calls.master import NoAnswer

SERVICE, OURS = "/gazebo/get_loggers", "rosrpc://127.0.0.1:1"


class Setting:
    """A watch, and what it does and tells."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.master = FakeMaster()
        self.master.services[SERVICE] = OURS
        self.use(self.master, monkeypatch)
        self.told: list[str] = []
        self.registered = 0
        for level in ("logwarn", "loginfo"):
            monkeypatch.setattr(rospy, level, lambda text, *args: self.told.append(text % args))
        monkeypatch.setattr(rospy, "get_param", lambda name: {"/use_sim_time": False}[name])
        monkeypatch.setattr(rospy, "get_name", lambda: "/gazebo")
        monkeypatch.setattr(master_watch, "witness", lambda: (SERVICE, OURS))
        self.watch = MasterWatch(self.register)

    def use(self, master: FakeMaster, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setenv("ROS_MASTER_URI", master.uri)

    def register(self, timeout: float) -> None:
        self.registered += 1
        self.master.services[SERVICE] = OURS


@pytest.fixture
def setting(monkeypatch):
    made = Setting(monkeypatch)
    yield made
    made.master.close()


def test_one_that_knows_us_is_left_alone(setting) -> None:
    setting.watch.look()
    assert not setting.told and not setting.registered


def test_one_that_does_not_is_told_what_we_are_and_how_time_goes(setting) -> None:
    setting.master.services.clear()
    setting.watch.look()
    setting.watch.look()
    (told,) = setting.told
    assert "was started again: this node wasn't registered there, and is now" in told
    assert setting.registered == 1
    assert setting.master.params["/use_sim_time"] is False


def test_one_that_goes_meanwhile_is_asked_again(setting) -> None:
    def fail(timeout: float) -> None:
        raise NoAnswer("it went")

    register, setting.watch._register = setting.watch._register, fail
    setting.master.services.clear()
    setting.watch.look()
    assert not setting.told
    setting.watch._register = register
    setting.watch.look()
    assert setting.registered == 1 and len(setting.told) == 1


def test_another_node_of_our_name_is_told_and_left_alone(setting) -> None:
    setting.master.services[SERVICE] = "rosrpc://127.0.0.1:2"
    setting.watch.look()
    setting.watch.look()
    (told,) = setting.told
    assert "another node (at rosrpc://127.0.0.1:2) has the name /gazebo" in told
    assert not setting.registered


def test_a_master_that_is_gone_is_told_once_and_its_return_too(setting, monkeypatch) -> None:
    with monkeypatch.context() as away:
        away.setenv("ROS_MASTER_URI", "http://127.0.0.1:1")
        setting.watch.look()
        assert not setting.told, "one question may get lost"
        for _ in range(5):
            setting.watch.look()
    assert len(setting.told) == 1 and "http://127.0.0.1:1 is gone" in setting.told[0]
    setting.watch.look()
    assert "answers again" in setting.told[1] and not setting.registered


def test_at_the_end_nothing_is_registered_again(setting) -> None:
    setting.master.services.clear()
    setting.watch._ending.set()
    setting.watch.look()
    assert not setting.registered and not setting.told
