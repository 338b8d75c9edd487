"""Who listens to a topic, so that nothing is made up for nobody."""

from collections.abc import Callable
from typing import Any

import rospy

Publish = Callable[[Any], None]


def _nothing() -> None:
    """For who only wants to know the number."""


class SubscriberCount(rospy.SubscribeListener):
    """Counts a topic's subscribers."""

    def __init__(self, changed: Callable[[], None] = _nothing) -> None:
        """`changed` is called after each change, from a thread of rospy's."""
        super().__init__()
        self.size = 0
        self._changed = changed

    def peer_subscribe(
        self, topic_name: str, topic_publish: Publish, peer_publish: Publish
    ) -> None:
        self.size += 1
        self._changed()

    def peer_unsubscribe(self, topic_name: str, num_peers: int) -> None:
        self.size = num_peers
        self._changed()
