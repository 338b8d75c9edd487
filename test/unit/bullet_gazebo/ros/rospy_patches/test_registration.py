"""Where no thread is left for a moment, publishers are connected to once there is."""

from __future__ import annotations

import threading
from types import SimpleNamespace

import pytest
import rospy
import rospy.impl.registration
from rospy.impl.registration import RegManager

from bullet_gazebo.ros.wire.rospy_patches import registration
from bullet_gazebo.ros.wire.rospy_patches.registration import outlive_lack_of_threads

BOUND = 60.0  # [s]


class Handler:
    """Connects to publishers, as the node does."""

    def __init__(self) -> None:
        self.done = False
        self.connected: list[tuple[str, str]] = []
        self.news = threading.Event()

    def _connect_topic(self, topic: str, uri: str):
        self.connected.append((topic, uri))
        self.news.set()
        return 1, "", 0


def test_it_goes_on_after_a_moment_without_threads(monkeypatch) -> None:
    told: list[str] = []
    monkeypatch.setattr(rospy, "logwarn", lambda text, *args: told.append(text % args))
    monkeypatch.setattr(rospy, "is_shutdown", lambda: False)
    monkeypatch.setattr(rospy.impl.registration, "is_shutdown", lambda: False)
    topics = SimpleNamespace(check_all=lambda: None)
    monkeypatch.setattr(rospy.impl.registration, "get_topic_manager", lambda: topics)
    monkeypatch.setattr(registration, "RECOVERY", 0.01)
    for name in ("run", "publisher_update"):
        monkeypatch.setattr(RegManager, name, getattr(RegManager, name))
    outlive_lack_of_threads()
    handler, refusals = Handler(), iter([True] * 3)
    manager = RegManager(handler)
    thread = threading.Thread(target=manager.run, daemon=True)
    thread.start()
    start = threading.Thread.start

    def short(each: threading.Thread) -> None:
        if next(refusals, False):
            raise RuntimeError("can't start new thread")
        start(each)

    monkeypatch.setattr(threading.Thread, "start", short)
    manager.publisher_update("/command", ["http://publisher"])
    try:
        assert handler.news.wait(BOUND)
    finally:
        handler.done = True
        thread.join(BOUND)
    assert ("/command", "http://publisher") in handler.connected
    assert len(told) == 1 and "can't start new thread" in told[0]


@pytest.mark.parametrize("over", ["shutdown", "done"])
def test_it_ends_with_the_node(monkeypatch, over: str) -> None:
    for name in ("run", "publisher_update"):
        monkeypatch.setattr(RegManager, name, getattr(RegManager, name))
    outlive_lack_of_threads()
    monkeypatch.setattr(rospy, "is_shutdown", lambda: over == "shutdown")
    handler = Handler()
    handler.done = True
    RegManager(handler).run()
