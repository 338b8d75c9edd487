"""What the simulator publishes, whole and in order: its messages come with calls, not over connections."""

import socket
from collections.abc import Iterable, Sequence

from bullet_gazebo_msgs.msg import TopicMessage
from bullet_gazebo_msgs.srv import AdvanceWorld, AdvanceWorldRequest
from rosgraph.network import write_ros_handshake_header

from ros_calls import master
from ros_calls.master import NoAnswer, Refused
from ros_calls.service import ServiceClient, ServiceFailed
from ros_utils._internal import nodes

SIMULATOR = "/gazebo"
PATIENCE = 30.0  # [s of wall time] for an answer
LONGEST = 500  # ticks in one call


class WorldError(Exception):
    """The test asks for something that can't be done; the text says what."""


class LockstepSubscriber:
    """A subscriber without a node of its own, in lock-step only; see AdvanceWorld.srv."""

    def __init__(self, name: str) -> None:
        """`name` is a node's that isn't there."""
        self._name = name
        self._connections: dict[str, socket.socket] = {}
        self._heard: list[TopicMessage] = []
        self._call = ServiceClient(
            f"{SIMULATOR}/advance_world", AdvanceWorld, persistent=True, timeout=PATIENCE
        )
        self._call(AdvanceWorldRequest(node=name))  # what comes from now on is kept for it

    def listen(self, topics: Iterable[str]) -> None:
        """Subscribes to topics, as far as it hasn't yet.

        Raises:
            WorldError: the simulator doesn't publish one.
        """
        new = [topic for topic in topics if topic not in self._connections]
        for topic in new:
            self._connections[topic] = self._connect(topic)
        if new:
            request = AdvanceWorldRequest(node=self._name, connect=True, subscriptions=new)
            self._heard += self._call(request).messages

    def _connect(self, topic: str) -> socket.socket:
        address = nodes.node_uri(SIMULATOR) or ""
        try:
            _, host, port = master.call_node(address, "requestTopic", topic, [["TCPROS"]])
        except (NoAnswer, Refused, ValueError) as fault:
            raise WorldError(f"the simulator doesn't publish {topic}") from fault
        connection = socket.create_connection((host, port), PATIENCE)
        header = {"callerid": self._name, "topic": topic, "md5sum": "*", "type": "*"}
        write_ros_handshake_header(connection, header)
        return connection

    def advance(self, ticks: int, until: Sequence[str] = ()) -> tuple[int, list[TopicMessage]]:
        """Lets at most `ticks` pass, until there is a message on a topic of `until` for any of its kind.

        Returns:
            How many have passed, and the messages since the last call.

        Raises:
            WorldError: the world is paused, so that no time would ever pass.
        """
        request = AdvanceWorldRequest(node=self._name, ticks=min(ticks, LONGEST), until=until)
        answer = self._call(request)
        if ticks and answer.paused:
            raise WorldError("the world is paused: no time passes")
        heard, self._heard = [*self._heard, *answer.messages], []
        return int(answer.ticks), heard

    def close(self) -> None:
        """Ends the subscriptions; what hasn't been heard is dropped, so that it ends no one's steps."""
        for connection in self._connections.values():
            connection.close()
        try:
            self._call(AdvanceWorldRequest(node=self._name))
        except ServiceFailed:  # the simulator has ended
            return
        finally:
            self._call.close()
