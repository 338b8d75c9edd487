"""The policy's node on a robot, without ROS's servers."""

import threading
from types import SimpleNamespace

import pytest
import rospy
from std_msgs.msg import Float64

from robot_envs.deployment import policy_node
from robot_envs.deployment.policy_node import PolicyNode
from robot_envs.robots.furuta import ROBOT as FURUTA
from robot_envs.robots.furuta import SwingUp
from robot_envs.world_state import JointState


class Reset(PolicyNode):
    """Begins, and its simulation is reset while it does the first step; ends when it has begun again."""

    def __init__(self) -> None:
        self._period, self.time, self.begun = 0.02, 70.0, 0
        self._joints = self._sensors = SimpleNamespace(forget=lambda: None)
        self._is_killed = threading.Event()
        self._should_end = lambda: self.begun == 2 or 1.0 < self.time < 70.0

    def now(self) -> float:
        self.time += 0.5
        return self.time

    def _begin(self) -> float:
        self.begun += 1
        return self.now()

    def _let_go(self) -> None:
        self.let_go = self.begun

    def _step(self, now: float, passed: float) -> None:
        self.time = 0.0


def test_a_reset_while_it_does_a_step_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    node = Reset()
    monkeypatch.setattr(rospy, "get_time", node.now)
    monkeypatch.setattr(rospy.rostime, "is_wallclock", lambda: False)
    node._follow()
    assert node.begun == 2 and node.let_go == 1, "it lets go before it begins anew"


class Topic(SimpleNamespace):
    """A publisher, or a subscriber, of nobody."""

    def __init__(self, name: str, kind: type, *_: object, **options: object) -> None:
        super().__init__(resolved_name=name, data_class=kind, listeners=1, sent=[])

    def get_num_connections(self) -> int:
        return self.listeners

    def publish(self, message: Float64) -> None:
        self.sent.append(message.data)


@pytest.fixture
def furuta(monkeypatch: pytest.MonkeyPatch) -> PolicyNode:
    monkeypatch.setattr(rospy, "Publisher", Topic)
    monkeypatch.setattr(rospy, "Subscriber", Topic)
    monkeypatch.setattr(rospy, "get_time", lambda: 5.0)
    monkeypatch.setattr(policy_node, "ControllerWatch", lambda *_: SimpleNamespace(trouble=""))
    monkeypatch.setattr(policy_node, "POLL", 0.0)
    return PolicyNode(FURUTA, SwingUp(), lambda _: [1.0], FURUTA.control_period)


def commanded(node: PolicyNode) -> list[float]:
    (topic,) = node._topics.values()
    return topic.sent


def test_while_it_waits_again_no_effort_is_left_on(furuta: PolicyNode) -> None:
    polls = iter([False] * 3)
    furuta._should_end = lambda: next(polls, True)
    furuta._begin()
    assert commanded(furuta) == [], "nothing was commanded, and nothing is"
    furuta._last = {name: JointState(0.0, 0.0, 0.0) for name in FURUTA.joints}
    polls = iter([False] * 3)
    furuta._begin()
    assert commanded(furuta) == [0.0, 0.0, 0.0]


def test_it_stops_when_nobody_listens_any_more(furuta: PolicyNode) -> None:
    for name in FURUTA.joints:
        furuta._joints._known[name] = JointState(0.0, 0.0, 0.0), rospy.Time(5), 5.0
    assert furuta._trouble(0.0) == ""
    (topic,) = furuta._topics.values()
    topic.listeners = 0
    assert furuta._trouble(0.0) == f"nobody listens to {topic.resolved_name} any more"


def test_messages_that_cannot_be_read_are_told_before_those_that_are_missing(
    furuta: PolicyNode,
) -> None:
    fault = "the sensor 'camera': pictures are yuv422"
    furuta._sensors = SimpleNamespace(missing=lambda: ["/eye/image_raw"], fault=lambda: fault)
    for name in FURUTA.joints:
        furuta._joints._known[name] = JointState(0.0, 0.0, 0.0), rospy.Time(5), 5.0
    assert furuta._missing() == f"a message that can be read: {fault}"
    furuta._sensors.fault = str
    assert furuta._missing() == "a message on /eye/image_raw"


def test_reasons_that_change_fast_are_a_line_a_second(
    furuta: PolicyNode, monkeypatch: pytest.MonkeyPatch
) -> None:
    lines, now = [], 0.0
    monkeypatch.setattr(rospy, "logwarn", lines.append)
    monkeypatch.setattr(rospy, "loginfo", lines.append)
    monkeypatch.setattr(policy_node, "time", SimpleNamespace(monotonic=lambda: now))
    for number in range(1000):
        now = 1.0 + number * 0.002
        furuta._report(f"state {number}")
    assert lines == ["state 0", "state 500 (499 other changes before)"]
    now = 2.5
    furuta._report("")
    assert len(lines) == 2, "it is told later"
    now = 3.5
    furuta._report("")
    assert lines[2:] == ["continuing (499 other changes before)"]
