"""What is kept for nodes in lock-step until they ask for it."""

import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace

import pytest
from rospy.impl import tcpros_pubsub

from bullet_gazebo.common.rospy_internals import publish_without_yielding
from bullet_gazebo.services import advance_service as module
from bullet_gazebo.services.advance_service import Mailbox, Mailboxes


@pytest.fixture
def boxes(monkeypatch):
    """Those of a process without a node; what is diverted can be looked at."""
    diverted = {}
    monkeypatch.setattr(module, "divert_messages", lambda sink: diverted.update(sink=sink))
    monkeypatch.setattr(module, "divert_connections", lambda node, sink: diverted.update({node: sink}))
    monkeypatch.setattr(module, "on_topics_changed", lambda call: diverted.update(changed=call))
    monkeypatch.setattr(module, "publish_without_yielding", lambda: None)
    topics = {"/a": [SimpleNamespace(endpoint_id="/script")]}
    monkeypatch.setattr(module, "connections", lambda topic: topics.get(topic, ()))
    made = Mailboxes()
    made.diverted, made.topics = diverted, topics
    return made


@pytest.fixture
def switch_often():
    """Lets threads take turns at almost every instruction."""
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-5)
    yield
    sys.setswitchinterval(before)


def contents(box):
    return [(message.topic, message.data) for message in box.take()]


def test_a_topic_is_heard_while_a_node_that_asks_for_time_is_connected(boxes):
    assert not boxes.any_hears("/a")
    boxes.of("/script")
    assert boxes.any_hears("/a")
    assert not boxes.any_hears("/b")
    boxes.topics["/a"] = []
    assert not boxes.any_hears("/a")
    boxes.topics["/a"] = [SimpleNamespace(endpoint_id=node) for node in ("/other", "/script")]
    assert boxes.any_hears("/a")


def test_messages_are_taken_once_in_their_order():
    box = Mailbox()
    for topic, data in (("/a", b"1"), ("/b", b"2"), ("/a", b"3")):
        box.put(topic, data)
    assert contents(box) == [("/a", b"1"), ("/b", b"2"), ("/a", b"3")]
    assert contents(box) == []


def test_what_is_awaited_is_seen_until_it_is_taken():
    box = Mailbox()
    box.put("/a", b"1")
    assert not box.has_awaited
    box.awaited = frozenset(["/a", "/b"])
    assert box.has_awaited
    box.take()
    assert not box.has_awaited
    box.put("/c", b"1")
    assert not box.has_awaited


def test_who_never_asks_loses_the_oldest(monkeypatch):
    monkeypatch.setattr(module, "MOST_BYTES", 10)
    box = Mailbox()
    for number in range(5):
        box.put("/a", bytes([number]) * 4)
    assert [data[0] for _, data in contents(box)] == [3, 4]
    box.put("/a", b"1234567890")  # room again
    assert len(contents(box)) == 1


def test_a_node_s_messages_are_diverted_from_its_first_request_on(boxes):
    sink = boxes.diverted["sink"]
    assert sink("/script") is None
    box = boxes.of("/script")
    assert boxes.of("/script") is box
    for put in (sink("/script"), boxes.diverted["/script"]):
        put("/a", b"1")
    assert sink("/other") is None
    assert len(contents(box)) == 2


def test_nodes_that_have_what_they_wait_for_are_named(boxes):
    one, other = boxes.of("/one"), boxes.of("/other")
    one.awaited = other.awaited = frozenset(["/a"])
    assert not boxes.has_awaited
    other.put("/a", b"1")
    assert boxes.has_awaited
    assert boxes.nodes_to_wake() == ["/other"]


def test_connecting_waits_for_topics_of_this_process_only(boxes, monkeypatch):
    looks = []

    def is_connected(topic, node, publishes):
        assert node == "/script"
        looks.append(topic)
        if topic == "/elsewhere":
            return None  # this process has no such topic
        return len(looks) > 10

    monkeypatch.setattr(module, "is_connected", is_connected)
    heard, told = boxes.connect("/script", ["/states", "/elsewhere"], ["/command", "/elsewhere"])
    assert (heard, told) == (["/states"], ["/command"])
    assert len(looks) > 10


def test_connecting_ends_although_nobody_comes(boxes, monkeypatch):
    monkeypatch.setattr(module, "CONNECTING", 0.05)
    monkeypatch.setattr(module, "is_connected", lambda *_: False)
    assert boxes.connect("/script", ["/states"], []) == (["/states"], [])


def test_publishing_gives_the_processor_away_no_more(monkeypatch):
    slept = []
    monkeypatch.setattr(tcpros_pubsub, "time", time)  # so that it is put back
    publish_without_yielding()
    monkeypatch.setattr(time, "sleep", slept.append)
    tcpros_pubsub.time.sleep(0)
    tcpros_pubsub.time.sleep(0.25)
    assert slept == [0.25]


def test_clients_may_come_while_others_ask_and_time_passes(boxes, switch_often):
    """Each of 10 threads comes as 50 clients, and all of them as 50 others."""
    finished = threading.Event()

    def come(thread):
        for number in range(50):
            box = boxes.of(f"/client_{thread}_{number}")
            shared = boxes.of(f"/shared_{number}")
            box.awaited = frozenset([f"/{thread}"])
            box.put(f"/{thread}", b"1")
            shared.put("/a", b"1")
            boxes.nodes_to_wake()
            assert contents(box) == [(f"/{thread}", b"1")]

    def tick():
        while not finished.is_set():
            boxes.has_awaited  # noqa: B018
            boxes.any_hears("/a")

    with ThreadPoolExecutor(11) as pool:
        ticks = pool.submit(tick)
        try:
            list(pool.map(come, range(10)))
        finally:
            finished.set()
        ticks.result()
    # Two boxes for one node would each have a part of its messages.
    assert [len(boxes.of(f"/shared_{number}").take()) for number in range(50)] == [10] * 50
