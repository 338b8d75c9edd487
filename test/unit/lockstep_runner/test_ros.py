"""Waits for messages that don't come."""

from unittest.mock import Mock

import pytest
import rospy
from sensor_msgs.msg import LaserScan
from support.ros.lockstep_world import MS

from lockstep_runner.replaced import ros
from ros_calls import master

PLUGIN = "<plugin filename='a.so'><topicName> scan </topicName></plugin>"


@pytest.mark.parametrize(
    ("publishers", "description", "spawned", "reason"),
    [
        ([], "", [0, 1], "it has no publisher"),
        ([], PLUGIN, [0, 1], "by a sensor or plugin that isn't simulated"),
        ([], PLUGIN, [0, 0], "and no model has been spawned yet"),
        ([["/turtle/scan", ["/driver"]]], PLUGIN, [0, 1], "/driver offers it, and sends nothing"),
    ],
)
@pytest.mark.parametrize("timeout", [4.0, 25.0])
def test_silence_is_explained_once(
    runner, monkeypatch, capsys, publishers, description, spawned, reason, timeout
):
    monkeypatch.setattr(ros, "spawns", lambda: spawned)
    answers = {
        "getSystemState": [publishers, [], []],
        "getParamNames": ["/turtle/robot_description", "/rate"],
        "getParam": description,
    }
    monkeypatch.setattr(master, "call", lambda method, *_: answers[method])
    monkeypatch.setattr(rospy, "Subscriber", lambda *_: None)
    monkeypatch.setattr(ros._Last, "latched", lambda self: False)
    runner.topics.changed = lambda: None
    wait = ros._Waiting(runner, rospy.wait_for_message)
    for count in range(1, 6):
        with pytest.raises(rospy.ROSException, match="timeout exceeded"):
            wait("/turtle/scan", LaserScan, timeout)
        assert runner.clock.passed == count * timeout * 1000 * MS
        told = capsys.readouterr().err
        assert (reason in told) is (count == (3 if timeout < 10 else 1)), told
        assert told.count("\n") <= 1


def test_silence_ends_with_a_late_message(runner, monkeypatch):
    monkeypatch.setattr(rospy, "Subscriber", lambda *_: None)
    monkeypatch.setattr(ros._Last, "latched", lambda self: False)
    monkeypatch.setattr(ros, "_why", str)
    runner.topics.changed = lambda: None
    spans = []

    def wait_for(span, done, topics):
        spans.append(span)
        return len(spans) % 2 == 0  # each message comes after the first wait

    monkeypatch.setattr(runner, "wait", wait_for)
    wait = ros._Waiting(runner, rospy.wait_for_message)
    for _ in range(2):
        wait("/turtle/scan", LaserScan, 25.0)
    assert spans == [ros.SILENCE, 25.0 - ros.SILENCE] * 2


def test_the_simulator_is_seeded_before_a_sensor_has_a_listener(runner, monkeypatch):
    """It measures as soon as somebody listens, and noise depends on the seed."""
    calls = []

    def subscribe(self, *_):
        self.impl = Mock()
        calls.append("subscribed")

    for owner, name in (
        (rospy.topics.Publisher, "__init__"), (rospy.topics.Publisher, "publish"),
        (rospy, "wait_for_message"), (rospy.client, "wait_for_message"),
        (rospy.topics._TopicImpl, "add_connection"),
        (rospy.topics._SubscriberImpl, "receive_callback"),
    ):  # fmt: skip
        monkeypatch.setattr(owner, name, getattr(owner, name))
    monkeypatch.setattr(rospy.topics.Subscriber, "__init__", subscribe)
    monkeypatch.setattr(runner, "is_connected", lambda: calls.append("connected"))
    runner.topics.changed = lambda: None
    ros.replace_topics(runner)
    rospy.Subscriber("/scan", LaserScan)
    assert calls == ["connected", "subscribed"]


def test_without_a_simulator_a_node_says_so_before_it_waits_for_the_master(monkeypatch, capsys):
    monkeypatch.setenv("ROS_MASTER_URI", "http://127.0.0.1:1")
    told = []
    for name in ("init_node", "client"):
        monkeypatch.setattr(rospy, name, getattr(rospy, name))
    monkeypatch.setattr(rospy.client, "init_node", rospy.client.init_node)
    ros._replace_init(lambda name: told.append((name, capsys.readouterr().err)))
    rospy.init_node("script")
    ((name, err),) = told
    assert name == "script" and "no simulator in lock-step under http://127.0.0.1:1 yet" in err
    assert "roslaunch gazebo_ros empty_world.launch lockstep:=true" in err
