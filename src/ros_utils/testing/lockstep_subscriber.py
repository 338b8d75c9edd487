"""A subscriber in lock-step: messages come whole and in order, with calls."""

import socket

from bullet_gazebo_msgs.srv import AdvanceWorld, AdvanceWorldRequest
from rosgraph.network import write_ros_handshake_header

from ros_calls import master
from ros_calls.master import NoAnswer, Refused
from ros_calls.service import ServiceClient, ServiceFailed
from ros_utils._internal import nodes

SIMULATOR = "/gazebo"
ANSWER_PATIENCE = 30.0  # [s of wall time] for an answer
LONGEST = 500  # ticks in one call


class WorldError(Exception):
    """The test asks for something that can't be done; the text says what."""


class LockstepSubscriber:
    """A subscriber, in lock-step only, of a simulator's topic; see AdvanceWorld.srv.

    `name` is a node's that isn't there. Raises WorldError if the simulator doesn't publish the topic.
    """

    def __init__(self, name: str, topic: str) -> None:
        self._name, self._topic = name, topic
        address = nodes.node_uri(SIMULATOR) or ""
        try:
            _, host, port = master.call_node(address, "requestTopic", topic, [["TCPROS"]])
        except (NoAnswer, Refused, ValueError) as fault:
            raise WorldError(f"the simulator doesn't publish {topic}") from fault
        self._call = ServiceClient(
            f"{SIMULATOR}/advance_world", AdvanceWorld, persistent=True, timeout=ANSWER_PATIENCE
        )
        self._call(AdvanceWorldRequest(node=name))  # what comes from now on is kept for it
        self._connection = socket.create_connection((host, port), ANSWER_PATIENCE)
        header = {"callerid": name, "topic": topic, "md5sum": "*", "type": "*"}
        write_ros_handshake_header(self._connection, header)
        request = AdvanceWorldRequest(node=name, connect=True, subscriptions=[topic])
        self._heard = len(self._call(request).messages)

    def advance(self, ticks: int) -> tuple[int, int]:
        """Advances until there is a message; returns the ticks that passed, and the number of messages.

        Raises WorldError if the world is paused, so that no time would ever pass.
        """
        request = AdvanceWorldRequest(
            node=self._name, ticks=min(ticks, LONGEST), until=[self._topic]
        )
        answer = self._call(request)
        if ticks and answer.paused:
            raise WorldError("the world is paused: no time passes")
        heard, self._heard = self._heard + len(answer.messages), 0
        return int(answer.ticks), heard

    def close(self) -> None:
        """Ends the subscription; what hasn't been heard is dropped, so that it ends no one's steps."""
        self._connection.close()
        try:
            self._call(AdvanceWorldRequest(node=self._name))
        except ServiceFailed:  # the simulator has ended
            return
        finally:
            self._call.close()
