"""Topics of a world faster than real time, and what an action keeps until somebody delivers it."""

import threading
from types import SimpleNamespace
from unittest.mock import MagicMock

import pytest

from bullet_gazebo.common import publishing
from bullet_gazebo.common.publishing import SubscriberCount, ThinnedTopic, Thinner
from bullet_gazebo.control import actions
from bullet_gazebo.control.trajectory_action import TrajectoryAction
from robot_sim.control.trajectory_goals import SUCCEEDED, GoalOutcome, TrajectorySample
from robot_sim.timing import FairLock

BOUND = 60.0  # [s]


class Reader:
    """What was published, and a way to wait for it."""

    def __init__(self):
        self.got = []
        self._news = threading.Condition()

    def __call__(self, sample):
        with self._news:
            self.got.append(sample)
            self._news.notify_all()

    def wait_for(self, sample):
        with self._news:
            return self._news.wait_for(lambda: self.got and self.got[-1] == sample, BOUND)


@pytest.fixture
def sim():
    return SimpleNamespace(outruns_the_clock=True)


@pytest.fixture
def thinner(sim):
    thinner = Thinner(sim)
    yield thinner
    thinner._stop()


@pytest.fixture
def reader():
    return Reader()


@pytest.fixture
def topic(thinner, reader):
    return ThinnedTopic(thinner, "/topic", reader)


def test_the_newest_is_always_sent_and_order_kept(topic, reader):
    for sample in range(100_000):
        topic.send(sample)
    assert reader.wait_for(99_999)
    assert reader.got[0] == 0
    assert reader.got == sorted(set(reader.got))
    assert len(reader.got) < 10_000


def test_in_real_time_everything_is_sent_at_once(sim, topic, reader):
    sim.outruns_the_clock = False
    for sample in range(1000):
        topic.send(sample)
    assert reader.got == list(range(1000))


def test_a_world_that_slows_down_sends_nothing_stale(sim, topic, reader, monkeypatch):
    monkeypatch.setattr(publishing, "PERIOD", BOUND)
    topic.send(1)
    topic.send(2)  # kept
    sim.outruns_the_clock = False
    for sample in (3, 4, 5):
        topic.send(sample)
    topic.flush()
    assert reader.got == [1, 3, 4, 5]


def test_a_closed_topic_publishes_nothing(topic, reader):
    topic.send(1)
    topic.send(2)
    topic.close()
    topic.send(3)
    topic.flush()
    assert reader.got in ([1], [1, 2])


def test_a_message_that_can_not_be_sent_silences_no_other(thinner, topic, reader, monkeypatch):
    told = threading.Event()
    monkeypatch.setattr(publishing.rospy, "logerr_throttle", lambda period, text: told.set())

    def fail(sample):
        raise OverflowError("no number for a message")

    bad = ThinnedTopic(thinner, "/topic", fail)
    bad._kept = 1
    thinner.remember(bad)
    assert told.wait(BOUND)
    for sample in range(1000):
        topic.send(sample)
    assert reader.wait_for(999)


def test_a_subscriber_that_comes_while_the_last_one_goes_is_counted(monkeypatch):
    """rospy counts who is left first, and tells it later."""
    monkeypatch.setattr(publishing, "subscribers", lambda topic: ["/script"])
    count = SubscriberCount()
    count.peer_subscribe("/a", None, None)
    count.peer_unsubscribe("/a", 0)
    assert count.size == 1


@pytest.fixture
def action(monkeypatch) -> TrajectoryAction:
    """One of a world in lock-step; its sim is the test's to change."""
    monkeypatch.setattr(actions, "SteadyActionServer", MagicMock())
    sim = SimpleNamespace(lock=FairLock(), outboxes=[], deliver_with_steps=True, sim_time=0.0)
    made = TrajectoryAction(sim, MagicMock(), "/arm")
    made.sim = sim
    return made


def test_only_the_newest_feedback_of_a_goal_waits_for_its_delivery(action) -> None:
    goals = MagicMock(), MagicMock()
    for goal in goals:
        for second in range(100):
            stamp = second * 10**9
            action.note(goal, TrajectorySample(stamp, ("hinge",), ((), (), ()), ((), ()), ((), ())))
        action.note(goal, GoalOutcome(SUCCEEDED), last=True)
    action.deliver()
    action.shutdown()
    for goal in goals:
        (told,) = goal.publish_feedback.call_args_list
        assert told.args[0].header.stamp.secs == 99
        goal.set_succeeded.assert_called_once()


def test_an_action_is_closed_after_the_result_that_a_step_delivers(action) -> None:
    order = []
    action._server.stop.side_effect = lambda: order.append("closed")
    closer = threading.Thread(target=action.shutdown)

    def settle(*_) -> None:
        closer.start()
        closer.join(0.3)  # it waits for this
        order.append("told")

    goal = MagicMock()
    goal.set_succeeded.side_effect = settle
    action.note(goal, GoalOutcome(SUCCEEDED), last=True)
    action.deliver()
    closer.join()
    assert order == ["told", "closed"]
    action.sim.sim_time, before = 100.0, action._server.publish_status.call_count
    action.deliver()  # by a step that began before
    assert action._server.publish_status.call_count == before
