"""Messages for nodes that let time pass in lock-step: kept in order until the node asks for them."""

import threading
import time
from collections.abc import Callable, Sequence

from bullet_gazebo_msgs.msg import TopicMessage

from bullet_gazebo.ros.common.rospy_topics import (
    divert_connections,
    divert_messages,
    is_connected,
    on_topics_changed,
    publish_without_yielding,
)

CONNECTING = 2.0  # [s of wall time] for a node to connect to its topics
LOOK = 0.002  # [s]
MOST_BYTES = 256 * 2**20  # [bytes] for one node; beyond it the node listens and never asks


class Mailbox:
    """The messages for one node."""

    def __init__(self) -> None:
        self._guard = threading.Lock()
        self._kept: list[TopicMessage] = []
        self._topics: set[str] = set()
        self._size = 0  # [bytes]
        self.awaited: frozenset[str] = frozenset()  # topics that the node waits for

    def put(self, topic: str, data: bytes) -> None:
        """Keeps a message; beyond MOST_BYTES the oldest ones are dropped."""
        with self._guard:
            self._kept.append(TopicMessage(topic, data))
            self._topics.add(topic)
            self._size += len(data)
            while self._size > MOST_BYTES:
                self._size -= len(self._kept.pop(0).data)

    @property
    def has_awaited(self) -> bool:
        """Whether there is a message that the node waits for."""
        return not self._topics.isdisjoint(self.awaited)

    def take(self) -> list[TopicMessage]:
        """Returns the messages in the order in which they were published, and empties the box."""
        with self._guard:
            taken, self._kept = self._kept, []
            self._topics.clear()
            self._size = 0
        return taken


class Mailboxes:
    """The mailboxes of all nodes that have asked for time."""

    def __init__(self) -> None:
        self.changes = 0  # of the topics that this process publishes or subscribes to
        self._boxes: dict[str, Mailbox] = {}
        divert_messages(self._sink)
        publish_without_yielding()
        on_topics_changed(self._count_change)

    def of(self, node: str) -> Mailbox:
        """Returns the mailbox of a node; its messages go there from the first call on."""
        box = self._boxes.get(node)
        if box is None:
            box = self._boxes[node] = Mailbox()
            divert_connections(node, box.put)
        return box

    @property
    def has_awaited(self) -> bool:
        """Whether there is a message that some node waits for."""
        return any(box.has_awaited for box in self._boxes.values())

    def nodes_to_wake(self) -> list[str]:
        """Returns the nodes whose awaited messages have come."""
        return [node for node, box in self._boxes.items() if box.has_awaited]

    def any_hears(self, topic: str) -> bool:
        """Whether one of the nodes is connected to a topic that this process publishes."""
        return any(is_connected(topic, node, publishes=True) for node in self._boxes)

    def connect(
        self, node: str, subscriptions: Sequence[str], publications: Sequence[str]
    ) -> tuple[list[str], list[str]]:
        """Waits until a node is connected to its topics, as far as this process has them too.

        Returns:
            The subscriptions that this process publishes, and the publications that it subscribes to.
        """
        deadline = time.monotonic() + CONNECTING
        ways = ((subscriptions, True), (publications, False))
        while any(
            is_connected(topic, node, publishes) is False
            for topics, publishes in ways
            for topic in topics
        ):
            if time.monotonic() > deadline:
                break
            time.sleep(LOOK)  # rospy doesn't report new connections of a subscriber
        heard, sent = (
            [topic for topic in topics if is_connected(topic, node, publishes) is not None]
            for topics, publishes in ways
        )
        return heard, sent

    def _sink(self, node: str) -> Callable[[str, bytes], None] | None:
        box = self._boxes.get(node)
        return box.put if box else None

    def _count_change(self) -> None:
        self.changes += 1
