"""Topics of a world that runs faster than real time: thinned by wall time, the newest message always sent.

A subscriber follows some thousand messages a second. In real time each message is sent, at once.
"""

import threading
import time
import traceback
from collections.abc import Callable
from typing import Any

import rospy

from bullet_gazebo.simulator import Simulator

PERIOD = 0.001  # [s of wall time] between two messages of a thinned topic
STOP_TIMEOUT = 1.0  # [s]
REPEAT = 1.0  # [s]; how often the same complaint is logged


class ThinnedTopic:
    """One topic. `publish` is called with the samples that are to be sent, in order."""

    def __init__(self, thinner: "Thinner", name: str, publish: Callable[[Any], None]) -> None:
        """The `name` is the topic's, resolved."""
        self._thinner = thinner
        self._name = name
        self._publish = publish
        self._guard = threading.Lock()
        self._waiting = False  # for the thinner, which will take what is kept then
        self._kept: Any = None
        self._newest: Any = None  # that was published
        self._sent = 0.0  # [s of wall time]

    def send(self, sample: Any) -> None:
        """Publishes the sample, or keeps it until its turn or a newer one comes; called by the tick."""
        # Nearly always, beyond real time: so this goes without the lock. When the world has just been
        # slowed down, the thinner may not have come round yet; then nothing waits for it any more.
        if self._waiting and self._thinned():
            self._kept = sample
            if self._waiting:  # still: flush() takes what is kept after it has cleared this
                return
        with self._guard:
            if sample is self._newest:  # flush() has been quicker
                return
            if self._thinned() and time.monotonic() - self._sent < PERIOD:
                self._kept = sample
                self._waiting = True
            else:
                self._waiting = False
                self._send_now(sample)
        if self._waiting:
            self._thinner.remember(self)

    def _thinned(self) -> bool:
        return self._thinner.active and not self._thinner.is_whole(self._name)

    def _send_now(self, sample: Any) -> None:
        self._kept, self._newest = None, sample
        self._sent = time.monotonic()
        self._publish(sample)

    def flush(self) -> None:
        """Publishes what is kept."""
        with self._guard:
            self._waiting = False
            if self._kept is not None:
                self._send_now(self._kept)

    def close(self) -> None:
        """Ends it; what is kept is dropped."""
        with self._guard:
            self._kept = None
            self._publish = _drop


def _drop(sample: Any) -> None:
    """For a topic that has been closed."""


def _never(_name: str) -> bool:
    return False


class Thinner:
    """Sends what thinned topics kept, from a thread of its own."""

    def __init__(self, sim: Simulator) -> None:
        self._sim = sim
        self._guard = threading.Lock()
        self._waiting: set[ThinnedTopic] = set()
        self._news = threading.Event()
        self._ending = threading.Event()
        self._sender = threading.Thread(target=self._send, name="thinned topics", daemon=True)
        self._sender.start()
        self.is_whole: Callable[[str], bool] = _never  # a topic that somebody needs all messages of
        rospy.on_shutdown(self._stop)

    @property
    def active(self) -> bool:
        """Whether the world runs, or is stepped, faster than real time."""
        return self._sim.outruns_the_clock

    def remember(self, topic: ThinnedTopic) -> None:
        """Has a topic flushed in a moment."""
        with self._guard:
            self._waiting.add(topic)
        self._news.set()

    def _send(self) -> None:
        while not self._ending.wait(PERIOD):
            self._news.wait()
            self._news.clear()
            with self._guard:
                waiting, self._waiting = self._waiting, set()
            for topic in waiting:
                self._flush(topic)

    def _flush(self, topic: ThinnedTopic) -> None:
        try:
            topic.flush()
        except Exception:  # noqa: BLE001 - whatever one topic's message has: the others go on
            if not rospy.is_shutdown():
                rospy.logerr_throttle(REPEAT, f"a message is lost:\n{traceback.format_exc()}")

    def _stop(self) -> None:
        self._ending.set()
        self._news.set()
        self._sender.join(STOP_TIMEOUT)
