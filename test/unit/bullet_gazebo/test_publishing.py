"""Topics of a world faster than real time: fewer messages, the newest always."""

import threading

import pytest

from bullet_gazebo.common import publishing
from bullet_gazebo.common.publishing import SubscriberCount, ThinnedTopic, Thinner

BOUND = 60.0  # [s]


class FakeSimulator:
    """As fast as it says."""

    outruns_the_clock = True


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
    return FakeSimulator()


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


def test_a_topic_whose_message_can_not_be_sent_silences_no_other(
    thinner, topic, reader, monkeypatch
):
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
