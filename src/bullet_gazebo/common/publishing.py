"""/clock, model_states and link_states (docs/contract/gazebo.md 1.3), and thinned topics for everybody.

Messages are made only for subscribers. One of these can follow some thousand messages a second. In real
time every message is sent at once. Faster than that, a topic sends one message per millisecond of wall time;
the newest one is always sent.
"""

import threading
import time
import traceback
from collections.abc import Callable
from functools import partial
from typing import Any

import rospy
from gazebo_msgs.msg import LinkStates, ModelStates
from rosgraph_msgs.msg import Clock

from bullet_gazebo.common.messages import to_pose_msg, to_time, to_twist_msg
from bullet_gazebo.common.rospy_internals import set_time, stop_hearing_clock, subscribers
from robot_sim.simulator import Simulator

PERIOD = 0.001  # [s of wall time] between two messages of a thinned topic
STOP_TIMEOUT = 1.0  # [s]
REPEAT = 1.0  # [s] between two logs of the same complaint
QUEUE = 10  # messages of /clock and the states


class SubscriberCount(rospy.SubscribeListener):
    """Counts a topic's subscribers, so that no message is built that no one receives."""

    def __init__(self, changed: Callable[[], None] = lambda: None) -> None:
        """Calls `changed` after each change, from a thread of rospy's."""
        super().__init__()
        self.size = 0
        self._guard = threading.Lock()
        self._changed = changed

    def peer_subscribe(self, topic_name: str, *_: object) -> None:
        with self._guard:  # several may come and go at once, each in a thread of its own
            self.size = len(subscribers(topic_name))
        self._changed()

    peer_unsubscribe = peer_subscribe


class ThinnedTopic:
    """One topic. It calls `publish` with the samples that it sends, in order."""

    def __init__(self, thinner: "Thinner", name: str, publish: Callable[[Any], None]) -> None:
        """`name` is the topic's, resolved."""
        self._thinner = thinner
        self._name = name
        self._publish = publish
        self._guard = threading.Lock()
        self._waiting = False  # for the thinner, which will send the kept sample
        self._kept: Any = None
        self._newest: Any = None  # the last sample that was published
        self._sent = 0.0  # [s of wall time]

    def send(self, sample: Any) -> None:
        """Publishes the sample, or keeps it until its turn or a newer one comes; called by the tick."""
        # Beyond real time nearly every call ends here, so this path takes no lock. When the world has just
        # been slowed down, the thinner may not have come round yet; then the sample doesn't wait for it.
        if self._waiting and self._thinned():
            self._kept = sample
            if self._waiting:  # still: flush() clears this before it takes the kept sample
                return
        with self._guard:
            if sample is self._newest:  # flush() was quicker
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
        """Publishes the kept sample."""
        with self._guard:
            self._waiting = False
            if self._kept is not None:
                self._send_now(self._kept)

    def close(self) -> None:
        """Drops the kept sample and publishes nothing from now on."""
        with self._guard:
            self._kept = None
            self._publish = lambda sample: None


class Thinner:
    """Sends the samples that thinned topics kept, from a thread of its own."""

    def __init__(self, sim: Simulator) -> None:
        self._sim = sim
        self._guard = threading.Lock()
        self._waiting: set[ThinnedTopic] = set()
        self._news = threading.Event()
        self._ending = threading.Event()
        self._sender = threading.Thread(target=self._send, name="thinned topics", daemon=True)
        self._sender.start()
        # Whether a subscriber needs every message of a topic.
        self.is_whole: Callable[[str], bool] = lambda name: False
        rospy.on_shutdown(self._stop)

    @property
    def active(self) -> bool:
        """Whether the world runs, or is stepped, faster than real time."""
        return self._sim.outruns_the_clock

    def remember(self, topic: ThinnedTopic) -> None:
        """Flushes a topic in a moment."""
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
                try:
                    topic.flush()
                except Exception:  # noqa: BLE001 - a message that can't be sent silences no other topic
                    if not rospy.is_shutdown():
                        rospy.logerr_throttle(REPEAT, f"a message is lost:\n{traceback.format_exc()}")

    def _stop(self) -> None:
        self._ending.set()
        self._news.set()
        self._sender.join(STOP_TIMEOUT)


class StateTopic(ThinnedTopic):
    """A topic with the state before each step, built only while it has subscribers."""

    def __init__(
        self, name: str, kind: type, sim: Simulator, thinner: Thinner, make: Callable[[], object]
    ) -> None:
        self._subscribers = SubscriberCount()
        self._sim = sim
        publisher = rospy.Publisher(
            name, kind, subscriber_listener=self._subscribers, queue_size=QUEUE, tcp_nodelay=True
        )
        # A sample only says that there is news: the message is long, and made when it is sent.
        super().__init__(thinner, publisher.resolved_name, lambda now: publisher.publish(make()))

    def __call__(self, now: int) -> None:
        if self._subscribers.size:
            self.send(now)

    def flush(self) -> None:
        with self._sim.lock:  # make() reads the world
            super().flush()


class ClockTopic(ThinnedTopic):
    """/clock: on every tick, or at a frequency."""

    def __init__(self, sim: Simulator, thinner: Thinner, frequency: float) -> None:
        """`frequency` [Hz of simulated time, up to 1e9] is ~pub_clock_frequency; 0 means every tick."""
        super().__init__(thinner, "/clock", self._publish_time)
        self._publisher = rospy.Publisher("/clock", Clock, queue_size=QUEUE, tcp_nodelay=True)
        self._period = round(1e9 / frequency) if frequency > 0 else 0
        self._last = -self._period
        # With use_sim_time:=false this node, like all others, goes by the wall clock.
        self._sets_own_time = bool(rospy.get_param("/use_sim_time", True))
        if self._sets_own_time:
            stop_hearing_clock()
            set_time(to_time(sim.now))

    def __call__(self, now: int) -> None:
        if self._period and 0 <= now - self._last < self._period:  # negative after a reset: publish
            return
        self._last = now
        self.send(now)

    def _publish_time(self, now: int) -> None:
        time = to_time(now)
        if self._sets_own_time:
            set_time(time)
        self._publisher.publish(Clock(time))


def advertise_states(sim: Simulator, thinner: Thinner, clock_frequency: float, network: bool) -> None:
    """Publishes /clock and, with `network`, the state topics, on the simulation's ticks."""
    topics: list[Callable[[int], None]] = [ClockTopic(sim, thinner, clock_frequency)]
    if network:
        for name, kind in (("~link_states", LinkStates), ("~model_states", ModelStates)):
            topics.append(StateTopic(name, kind, sim, thinner, partial(_states, sim, kind)))
    sim.listeners += topics

    def restored() -> None:
        for topic in topics:
            topic(sim.now)

    sim.restored.append(restored)


def _states(sim: Simulator, kind: type[ModelStates | LinkStates]) -> ModelStates | LinkStates:
    models = sim.world.models.values()
    if kind is ModelStates:
        states = [(model.name, *model.state()) for model in models]
    else:
        states = [
            (f"{model.name}::{link}", *model.link_state(link))
            for model in models
            for link in model.link_names
        ]
    return kind(
        name=[name for name, _, _ in states],
        pose=[to_pose_msg(pose) for _, pose, _ in states],
        twist=[to_twist_msg(twist) for _, _, twist in states],
    )
