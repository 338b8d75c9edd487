"""Joint states from anywhere: whole or in parts, repeated, without velocities, with numbers that are none."""

import math

import pytest
import rospy
from sensor_msgs.msg import JointState as JointStateMsg

from robot_envs.deployment import reports
from robot_envs.world_state import JointState
from robot_sim.control.joint import JointLimits


class Clock:
    now = 1.0  # [s] of ROS time


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock()
    monkeypatch.setattr(reports.rospy, "Subscriber", Subscriber)
    monkeypatch.setattr(reports.rospy, "get_time", lambda: clock.now)
    return clock


class Subscriber:
    def __init__(self, topic: str, kind: type, take: object, **options: object) -> None:
        self.resolved_name, self.take = topic, take


def listener(*joints: str) -> tuple[reports.JointListener, Subscriber]:
    limits = {"elbow": JointLimits(lower=-3.0, upper=3.0)}
    made = reports.JointListener("/joint_states", "arm", joints or ("elbow", "wrist"), limits)
    return made, made._subscriber


def message(stamp: float, **joints: tuple[float, ...]) -> JointStateMsg:
    found = JointStateMsg(name=[name.replace("__", "::") for name in joints])
    found.header.stamp = rospy.Time.from_sec(stamp)
    columns = list(zip(*joints.values(), strict=True))
    for field, values in zip(("position", "velocity", "effort"), columns, strict=False):
        setattr(found, field, list(values))
    return found


def test_joints_come_in_one_message_or_in_several(clock: Clock) -> None:
    joints, subscriber = listener()
    assert joints.missing() == ["elbow", "wrist"] and joints.topic == "/joint_states"
    subscriber.take(message(1.0, wrist=(0.1, 0.2, 0.3), finger=(9.0, 9.0, 9.0)))
    assert joints.missing() == ["elbow"]
    clock.now = 1.1
    subscriber.take(message(1.1, arm__elbow=(1.0, 2.0, 3.0)))
    known = {"elbow": JointState(1.0, 2.0, 3.0), "wrist": JointState(0.1, 0.2, 0.3)}
    assert joints.look() == (known, 1.0), "the oldest arrival"
    clock.now = 1.2
    subscriber.take(message(1.2, wrist=(0.2, 0.0, 0.0), elbow=(1.5, 0.0, 0.0)))
    assert joints.look()[1] == 1.2 and joints.look()[0]["elbow"].position == 1.5


@pytest.mark.parametrize(
    "useless",
    [
        message(1.0, elbow=(7.0, 7.0), wrist=(7.0, 7.0)),  # the same stamp once more
        message(0.5, elbow=(7.0, 7.0), wrist=(7.0, 7.0)),  # an older one
        message(2.0, elbow=(7.0,), wrist=(7.0,)),  # without velocities
        message(2.0, elbow=(math.nan, 7.0), wrist=(7.0, math.inf)),
        JointStateMsg(),
    ],
)
def test_what_tells_nothing_new_does_not_count(clock: Clock, useless: JointStateMsg) -> None:
    joints, subscriber = listener()
    subscriber.take(message(1.0, elbow=(1.0, 2.0), wrist=(1.0, 2.0)))
    clock.now = 1.5
    subscriber.take(useless)
    known = JointState(1.0, 2.0, 0.0)
    assert joints.look() == ({"elbow": known, "wrist": known}, 1.0)


def test_messages_without_stamps_are_all_new(clock: Clock) -> None:
    joints, subscriber = listener("elbow")
    for position in (1.0, 2.0):
        subscriber.take(message(0.0, elbow=(position, 0.0)))
        clock.now += 1.0
    assert joints.look() == ({"elbow": JointState(2.0, 0.0, 0.0)}, 2.0)


def test_what_was_forgotten_comes_anew_with_earlier_stamps(clock: Clock) -> None:
    joints, subscriber = listener("elbow")
    clock.now = 50.0
    subscriber.take(message(50.0, elbow=(1.0, 0.0)))
    joints.forget()
    clock.now = 0.1
    assert joints.missing() == ["elbow"]
    subscriber.take(message(0.1, elbow=(3.0, 0.0)))
    assert joints.look()[0]["elbow"].position == 3.0


@pytest.mark.parametrize(
    ("bad", "fault"),
    [
        (message(1.1, elbow=(50.0, 0.0)), "'elbow' is reported at position 50, beyond its stops"),
        (message(1.1, elbow=(1.0, 1e300)), "which no joint has"),
        (message(1.1, elbow=(1.0, 0.0, math.inf)), "effort inf"),
        (message(3600.0, elbow=(1.0, 0.0)), "stamped 3598.5 s in the future"),
        (message(1e-9, elbow=(1.0, 0.0)), "stamped 1.5 s in the past"),
    ],
)
def test_a_state_that_cannot_be_is_a_fault_until_a_good_one_comes(clock, bad, fault) -> None:
    joints, subscriber = listener("elbow")
    subscriber.take(message(1.0, elbow=(1.0, 0.0)))
    assert joints.fault() == ""
    clock.now = 1.5
    subscriber.take(bad)
    assert fault in joints.fault() and joints.look()[0]["elbow"].position == 1.0
    subscriber.take(message(1.2, elbow=(1.5, 0.0)))
    assert joints.fault() == "" and joints.look()[0]["elbow"].position == 1.5
