"""A node, in whatever language, whose commands have to arrive before time goes on."""

import contextlib
import queue
from collections.abc import Sequence

import rospy

from ros_calls import master
from ros_calls.commands import COMMANDS
from ros_calls.waiting import wait_until
from ros_utils import ros_node
from ros_utils._internal import nodes
from ros_utils._internal.programs import Started
from ros_utils.testing.lockstep_subscriber import (
    ANSWER_PATIENCE,
    SIMULATOR,
    LockstepSubscriber,
    WorldError,
)

CONNECTING = 30.0  # [s of wall time]


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
        self, name: str, package: str, executable: str, args: Sequence[str], hears: str,
        commands: str,
    ) -> None:  # fmt: skip
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
