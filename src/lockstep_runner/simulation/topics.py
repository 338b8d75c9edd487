"""The script's topics: connected to the simulator before anything goes over them, and closed to others."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import rospy
import rospy.impl.registration
from bullet_gazebo_msgs.msg import TopicMessage

from lockstep_runner import originals
from lockstep_runner.notices import Notices
from lockstep_runner.simulation.world import NODE, World

CONNECTING = 2.0  # [s of wall time]
LOOK = 0.001  # [s]
SILENT = ("/rosout", "/rosout_agg", "/clock", "/statistics")  # nothing that the simulator acts on
NOT_COMMANDS = ("/goal", "/cancel")  # of an action: it is waited for by other means


class Topics:
    """Connects what the script publishes and hears."""

    def __init__(self, world: World, notices: Notices) -> None:
        self.commands: frozenset[str] = (
            frozenset()
        )  # that the script publishes and the simulator hears
        self.follows: Callable[[str], bool] = lambda node: True
        self._world = world
        self._notices = notices
        self._changed = True
        self._seen = -1  # the simulator's count of changes
        self._heard: frozenset[str] = (
            frozenset()
        )  # that the script hears and the simulator publishes

    def changed(self) -> None:
        """The script has a publisher or a subscriber more."""
        self._changed = True

    @property
    def are_settled(self) -> bool:
        """Whether nothing has changed since `settle`."""
        return not self._changed and self._seen == self._world.topics_changed

    def settle(self) -> Sequence[TopicMessage]:
        """Waits until the script's topics are connected to the simulator, if there are new ones.

        Returns:
            Messages that have come meanwhile.
        """
        if self.are_settled:
            return ()
        self._changed = False
        manager = rospy.impl.registration.get_topic_manager()
        hears = [name for name in manager.subs if name not in SILENT]
        tells = [name for name in manager.pubs if name not in SILENT]
        response = self._world.advance(0, connect=(hears, tells))
        self._seen = response.topics_changed
        self._heard = frozenset(response.subscriptions)
        self.commands = frozenset(
            name
            for name in response.publications
            if not name.startswith(f"{NODE}/") and not name.endswith(NOT_COMMANDS)
        )
        deadline = originals.monotonic() + CONNECTING
        while originals.monotonic() < deadline:
            ends = [_has(manager.subs, name, "callerid_pub") for name in response.subscriptions]
            ends += [_has(manager.pubs, name, "endpoint_id") for name in response.publications]
            if all(ends):
                break
            originals.sleep(LOOK)
        messages: Sequence[TopicMessage] = response.messages
        return messages

    def lets_in(self, topic: Any, connection: Any) -> bool:
        """Whether messages over a connection go to the script's callbacks."""
        name, node = topic.resolved_name, connection.callerid_pub
        if node == NODE or name in SILENT or getattr(connection, "socket", None) is None:
            return True
        if name not in self._heard:
            if not self.follows(node):
                self._notices.once(
                    f"from {node}",
                    f"node {node} goes by the wall's time: when its messages on {name} come isn't"
                    " repeatable",
                )
            return True
        self._notices.once(
            f"others on {name}",
            f"{node} publishes on {name}, too, in wall time: its messages are left out",
        )
        return False


def _has(topics: dict[str, Any], name: str, attribute: str) -> bool:
    topic = topics.get(name)
    return topic is None or any(
        getattr(each, attribute, None) == NODE for each in topic.connections
    )
