"""The XML-RPC call `gazeboWorld` of the simulator's node, which `gz world` makes.

Every ROS node answers XML-RPC calls of master and tools (getPid, shutdown and so on). The simulator answers
one more: any machine finds it by the node's name, and it is neither a topic nor a service, of which there
must be only Gazebo's own (docs/contract/gazebo.md 7).
"""

from collections.abc import Callable
from contextlib import AbstractContextManager

from bullet_gazebo.ros.clients.gz import CHUNK, METHOD
from bullet_gazebo.ros.common.rospy_node import answer_xmlrpc
from bullet_gazebo.simulator import Simulator

Answer = tuple[int, str, int]
LONGEST = 80  # of an unknown command in an answer


class WorldControl:
    """The simulator's side of `bullet_gazebo.ros.clients.gz.RemoteWorld`."""

    def __init__(
        self,
        sim: Simulator,
        watchdog: AbstractContextManager[object],
        show: Callable[[], None] | None = None,
    ) -> None:
        """A fault in a block of `watchdog` ends the node. `show` opens the scene for a window."""
        self._sim = sim
        self._watchdog = watchdog
        self._commands = {
            "pause": sim.pause,
            "unpause": sim.unpause,
            "reset": sim.reset_simulation,
            "reset_models": sim.reset_world,
            "reset_time": sim.reset_time,
        }
        if show is not None:
            self._commands["show"] = show

    def offer(self) -> None:
        """Makes this process's node answer the call."""
        answer_xmlrpc(METHOD, self.answer)

    def answer(self, *arguments: object) -> Answer:
        """Runs a command; returns code (1 is success), text, ticks done.

        Args:
            arguments: the command; for "step" also the number of ticks, 1 by default. XML-RPC has no
                signatures: any number of arguments may come, of any of its types.
        """
        if not 1 <= len(arguments) <= 2:
            return _refused(
                f"{len(arguments)} arguments: a command, and for step a number of steps"
            )
        command, count = (*arguments, 1)[:2]
        # A bool is an int in Python, and no number here.
        if not isinstance(command, str) or type(count) is not int:
            kinds = " and ".join(type(each).__name__ for each in arguments)
            return _refused(f"{kinds}: a command is a string, a number of steps an integer")
        if command == "step":
            if not 1 <= count <= CHUNK:
                return _refused(f"{count} steps: one call does 1 to {CHUNK}")
            with self._watchdog:
                self._sim.step(count)
            return 1, "step", count
        if command not in self._commands:
            return _refused(f"unknown command {command[:LONGEST]!a}")
        with self._watchdog:
            self._commands[command]()
        return 1, command, 0


def _refused(reason: str) -> Answer:
    return -1, reason, 0
