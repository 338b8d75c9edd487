"""The node's name at the master: who is refused, who waits, and who registers again."""

from __future__ import annotations

import threading

import pytest
import rospy
from support.ros.ros_fakes import FakeMaster

from bullet_gazebo.ros.common.node_process import full_name, one_at_a_time
from bullet_gazebo.ros.node import master_watch
from bullet_gazebo.ros.node.master_watch import MasterWatch, NodeNameTaken, refuse_twin
from ros_calls.master import NoAnswer

BOUND = 60.0  # [s]
SERVICE, OURS = "/gazebo/get_loggers", "rosrpc://127.0.0.1:1"


class Setting:
    """A watch, and what it does and tells."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.master = FakeMaster()
        self.master.services[SERVICE] = OURS
        monkeypatch.setenv("ROS_MASTER_URI", self.master.uri)
        self.told: list[str] = []
        self.registered = 0
        for level in ("logwarn", "loginfo"):
            monkeypatch.setattr(rospy, level, lambda text, *args: self.told.append(text % args))
        monkeypatch.setattr(rospy, "get_param", lambda name: {"/use_sim_time": False}[name])
        monkeypatch.setattr(rospy, "get_name", lambda: "/gazebo")
        monkeypatch.setattr(master_watch, "witness", lambda: (SERVICE, OURS))
        self.watch = MasterWatch(self.register)

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
    assert "was restarted: this node wasn't registered there, and is now" in told
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
    with pytest.raises(
        NodeNameTaken, match="/gazebo runs at .* ROS_MASTER_URI=http://127.0.0.1:.* replace:=true"
    ):
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
    monkeypatch.setattr(master_watch.rospy.core, "add_preshutdown_hook", hooks.append)
    loss = master_watch.NameLoss()
    hooks[0]("external shutdown request from [/rosnode]: [user request]")
    assert not loss.happened
    hooks[0](
        "external shutdown request from [master]: [[/gazebo] Reason: new node registered with same name]"
    )
    assert loss.happened
    assert "another node has taken the name /gazebo" in loss.text("/gazebo")
