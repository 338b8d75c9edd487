"""The script's topics: connected to the simulator before their first message, closed to other publishers.

The simulator's messages reach the script's callbacks in order, in a worker thread as with rospy.
"""

import threading
from collections import defaultdict, deque
from collections.abc import Callable, Collection, Iterable, Sequence
from typing import Any

import rospy
import rospy.impl.registration
from bullet_gazebo_msgs.msg import TopicMessage

from lockstep_runner import originals
from lockstep_runner.notices import tell_once
from lockstep_runner.world import NODE, ScriptWorld

# Callbacks in a row that didn't act on the simulator; then time no longer stops for the topic.
QUIET_CALLBACKS = 20

Told = Callable[[threading.Thread], None]


class Callbacks:
    """Runs callbacks one at a time; `began` and `ended` get each worker when it starts and stops.

    While a callback waits for simulated time, another worker handles the messages of other topics; those of
    its own topic wait for it, as with rospy.
    """

    def __init__(self, began: Told, ended: Told) -> None:
        self._began = began
        self._ended = ended
        self._guard = threading.Lock()
        self._waiting: deque[TopicMessage] = deque()
        self._held: dict[str, list[TopicMessage]] = defaultdict(list)
        self._busy: set[str] = set()  # topics with a callback that hasn't returned
        self._idle: list[_Worker] = []
        self._quiet: dict[str, int] = defaultdict(int)
        self._current: dict[int, str] = {}  # topic whose callback a thread runs, by thread id

    def acted(self) -> None:
        """Notes that the callback in this thread, if one runs here, has acted on the simulator."""
        topic = self._current.get(threading.get_ident())
        if topic is not None:
            self._quiet[topic] = 0

    def stops(self, topics: Collection[str]) -> list[str]:
        """Returns the topics whose messages stop time: `topics`, and those whose callbacks act.

        A callback that commands the robot must do so before the next tick; stopping for one that only
        stores its message would cost speed for nothing.
        """
        acting = [name for name in self.heard() if self._quiet[name] < QUIET_CALLBACKS]
        return [*{*acting, *topics}]

    def heard(self) -> list[str]:
        """Returns the topics with callbacks, as any of them may end a wait."""
        return [name for name, topic in list(_topics().subs.items()) if topic.callbacks]

    def hand_out(self, messages: Iterable[TopicMessage]) -> None:
        """Queues messages for their callbacks and returns at once."""
        with self._guard:
            self._waiting.extend(messages)
            worker = self._idle.pop() if self._idle else None
        worker = worker or _Worker(self._work)
        self._began(worker)
        worker.go.release()

    def _work(self, worker: "_Worker") -> None:
        while True:
            with self._guard:
                if not self._waiting:
                    self._idle.append(worker)
                    break
                message = self._waiting.popleft()
                if message.topic in self._busy:
                    self._held[message.topic].append(message)
                    continue
                self._busy.add(message.topic)
            try:
                self._call(message)
            finally:
                with self._guard:
                    self._busy.discard(message.topic)
                    self._waiting.extendleft(reversed(self._held.pop(message.topic, [])))
        self._ended(worker)

    def _call(self, message: TopicMessage) -> None:
        topic = _topics().get_subscriber_impl(message.topic)
        if topic is None or not topic.callbacks:
            return
        connection = next((each for each in topic.connections if each.callerid_pub == NODE), None)
        if connection is None:
            return
        content = topic.data_class().deserialize(message.data[4:])
        content._connection_header = connection.header
        if connection.is_latched:
            connection.latch = content
        self._quiet[message.topic] += 1
        self._current[threading.get_ident()] = message.topic
        try:
            topic.receive_callback([content], connection)
        finally:
            del self._current[threading.get_ident()]


class _Worker(threading.Thread):
    """A thread that runs callbacks each time `go` is released."""

    def __init__(self, work: Callable[["_Worker"], None]) -> None:
        super().__init__(name="callbacks", daemon=True)
        self.go = threading.Lock()
        self.go.acquire()
        self._work = work
        originals.start(self)

    def run(self) -> None:
        while True:
            self.go.acquire()
            self._work(self)


def _topics() -> Any:
    return rospy.impl.registration.get_topic_manager()


CONNECTING = 20.0  # [s of wall time] on a busy machine; AdvanceService waits as long for its ends
CONNECTING_LOOK = 0.001  # [s]
SILENT = ("/rosout", "/rosout_agg", "/clock", "/statistics")  # the simulator acts on none of these
NOT_COMMANDS = ("/goal", "/cancel")  # of an action, whose client waits in other ways


class Topics:
    """Connects the script's publishers and subscribers to the simulator."""

    def __init__(self, world: ScriptWorld) -> None:
        # Topics that the script publishes and the simulator subscribes to
        self.commands: frozenset[str] = frozenset()
        self.follows: Callable[[str], bool] = lambda node: True
        self._world = world
        self._changed = True
        self._seen = -1  # the simulator's count of topic changes at the last `settle`
        # Topics that the script subscribes to and the simulator publishes
        self._heard: frozenset[str] = frozenset()
        self._given_up: set[str] = set()  # topics that haven't connected in time

    def changed(self) -> None:
        """Notes that the script has a new publisher or subscriber."""
        self._changed = True

    @property
    def are_settled(self) -> bool:
        """Whether nothing has changed since `settle`."""
        return not self._changed and self._seen == self._world.topics_changed

    def settle(self) -> Sequence[TopicMessage]:
        """Waits until new topics are connected to the simulator; returns messages that came meanwhile."""
        if self.are_settled:
            return ()
        self._changed = False
        manager = rospy.impl.registration.get_topic_manager()
        left_out = {*SILENT, *self._given_up}
        hears = [name for name in manager.subs if name not in left_out]
        tells = [name for name in manager.pubs if name not in left_out]
        deadline = originals.monotonic() + CONNECTING
        response = self._world.advance(0, connect=(hears, tells))
        self._seen = response.topics_changed
        self._heard = frozenset(response.subscriptions)
        self.commands = frozenset(
            name
            for name in response.publications
            if not name.startswith(f"{NODE}/") and not name.endswith(NOT_COMMANDS)
        )
        while missing := {
            *_without_simulator(manager.subs, response.subscriptions, "callerid_pub"),
            *_without_simulator(manager.pubs, response.publications, "endpoint_id"),
        }:
            if originals.monotonic() > deadline:
                self._give_up(missing)
                break
            originals.sleep(CONNECTING_LOOK)
        messages: Sequence[TopicMessage] = response.messages
        return messages

    def _give_up(self, names: Collection[str]) -> None:
        """Stops waiting for these topics: they never connect if their types differ."""
        self._given_up.update(names)
        for name in sorted(names):
            tell_once(
                f"no connection {name}",
                f"{name} hasn't connected to the simulator in {CONNECTING:g} s (is it of another type"
                " there?): its messages come by the wall's time, if at all",
            )

    def lets_in(self, topic: Any, connection: Any) -> bool:
        """Returns whether messages of a connection go to the script's callbacks."""
        name, node = topic.resolved_name, connection.callerid_pub
        if node == NODE or name in SILENT or getattr(connection, "socket", None) is None:
            return True
        if name not in self._heard:
            if not self.follows(node):
                tell_once(
                    f"from {node}",
                    f"node {node} goes by the wall's time: when its messages on {name} come isn't repeatable",
                )
            return True
        tell_once(
            f"others on {name}", f"{node} publishes on {name}, too, in wall time: its messages are left out"
        )
        return False


def _without_simulator(topics: dict[str, Any], names: Iterable[str], attribute: str) -> set[str]:
    """Returns the topics of the script that aren't connected to the simulator."""
    return {
        name
        for name in names
        if name in topics and all(getattr(each, attribute, None) != NODE for each in topics[name].connections)
    }
