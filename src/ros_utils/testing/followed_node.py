"""Other processes that time waits for: messages in lock-step, and a node that answers them with commands."""

import contextlib
import queue
import socket
from collections.abc import Sequence

import rospy
from bullet_gazebo_msgs.srv import AdvanceWorld, AdvanceWorldRequest
from rosgraph.network import write_ros_handshake_header

from ros_calls import master
from ros_calls.commands import COMMANDS
from ros_calls.master import NoAnswer, Refused
from ros_calls.service import ServiceClient, ServiceFailed
from ros_calls.waiting import wait_until
from ros_utils import ros_node
from ros_utils._internal import nodes
from ros_utils._internal.programs import Started

SIMULATOR = "/gazebo"
ANSWER_PATIENCE = 30.0  # [s of wall time] for an answer
LONGEST = 500  # ticks in one call
CONNECTING = 30.0  # [s of wall time]


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
        request = AdvanceWorldRequest(node=self._name, ticks=min(ticks, LONGEST), until=[self._topic])
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


class FollowedNode:
    """A node that answers each message of a topic of the simulator's with one command.

    The simulator reports to this process what it sends to the node, and ends a step after that. The commands
    come to this process, which gives them to the simulator with the next step. So it doesn't matter when a
    message arrives anywhere.

    Args:
        name, package, executable, args: Of the node.
        hears: The topic that it answers.
        commands: The topic of its answers, on which it commands a controller.

    Raises:
        WorldError: It doesn't start or connect, or the simulator doesn't publish `hears`.
    """

    def __init__(
        self, name: str, package: str, executable: str, args: Sequence[str], hears: str, commands: str
    ) -> None:
        self.controller = commands.rpartition("/")[0] or commands
        self.name, self._hears, self._waiting = f"/{name}", hears, 0
        self._answers: queue.SimpleQueue[rospy.AnyMsg] = queue.SimpleQueue()
        if not rospy.core.is_initialized():
            rospy.init_node("robot_test", anonymous=True, disable_signals=True)
        topic = f"{self.name}/commands"
        with contextlib.ExitStack() as ending:
            subscriber = LockstepSubscriber(f"{self.name}_subscriber", hears)
            self._subscriber = ending.enter_context(contextlib.closing(subscriber))
            started = ros_node.ros_node_from_pkg(
                package, executable, launch_new_term=False, name=name,
                args=[*args, f"{commands}:={topic}"], timeout=CONNECTING,
            )  # fmt: skip
            if not isinstance(started, Started):
                raise WorldError(f"{package}/{executable} doesn't run; the log says why")
            ending.callback(started.close)
            if not wait_until(self._is_connected, CONNECTING, hears):
                raise WorldError(f"{self.name} doesn't connect to {hears}")
            ending.callback(self._subscribe(topic, commands).unregister)
            self._ending = ending.pop_all()

    def _is_connected(self) -> bool:
        lines = master.call_node(nodes.node_uri(SIMULATOR) or "", "getBusInfo")
        return any(line[1:5:3] == [self.name, self._hears] for line in lines)

    def _subscribe(self, topic: str, commands: str) -> rospy.Subscriber:
        subscriber = rospy.Subscriber(topic, rospy.AnyMsg, self._answers.put, tcp_nodelay=True)
        if not wait_until(subscriber.get_num_connections, CONNECTING, topic):
            subscriber.unregister()
            raise WorldError(f"{self.name} publishes nothing on {commands}")
        return subscriber

    def advance(self, ticks: int) -> int:
        """Lets at most `ticks` pass, until a followed node has to answer; returns how many have."""
        passed, heard = self._subscriber.advance(ticks)
        self._waiting += heard
        return passed

    def answer(self) -> list[float]:
        """Waits for the answers to what the node has heard; returns the last command, or none."""
        self.advance(0)
        last: list[float] = []
        while self._waiting:
            try:
                last = _numbers(self._answers.get(timeout=ANSWER_PATIENCE))
            except queue.Empty:
                raise WorldError(
                    f"{self.name} hasn't answered a message on {self._hears} for {ANSWER_PATIENCE:g} s"
                ) from None
            self._waiting -= 1
        return last

    def close(self) -> None:
        """Ends it."""
        self._ending.close()


def _numbers(message: rospy.AnyMsg) -> list[float]:
    """Returns a command's numbers, as a step takes them."""
    name = message._connection_header["type"]
    followed = {kind.message: kind for kind in COMMANDS.values() if kind.topic}
    kind = followed.get(name)
    if kind is None:
        raise WorldError(f"a command is {name}: {', '.join(followed)} can be followed")
    return kind.numbers(kind.read(kind.message_type().deserialize(message._buff)))
