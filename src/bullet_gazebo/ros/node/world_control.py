"""What `gz world` needs of a running simulator, without a ROS name for it.

Every ROS node answers XML-RPC calls of master and tools at the address that the master knows
(getPid, shutdown and so on). The simulator's node answers one more there, `gazeboWorld`: found
through its node's name, from any machine, and neither a topic nor a service, of which Gazebo's own
must be the only ones (docs/contract/gazebo.md 7).
"""

import traceback

import rospy

from bullet_gazebo.ros.clients.world_client import CHUNK, METHOD
from bullet_gazebo.ros.wire.rospy_patches import answer_xmlrpc
from bullet_gazebo.simulator import Simulator

Answer = tuple[int, str, int]


class WorldControl:
    """The side of the simulator; the clients' is world_client.py."""

    def __init__(self, sim: Simulator) -> None:
        self._sim = sim
        self._commands = {
            "pause": sim.pause,
            "unpause": sim.unpause,
            "reset": sim.reset_simulation,
            "reset_models": sim.reset_world,
            "reset_time": sim.reset_time,
        }

    def offer(self) -> None:
        """Has this process's node answer."""
        answer_xmlrpc(METHOD, self.answer)

    def answer(self, command: str, count: int = 1) -> Answer:
        """Carries out a command, and answers in ROS's way: code (1 is success), text, ticks done."""
        if command == "step":
            if not 1 <= count <= CHUNK:
                return -1, f"{count} steps: 1 to {CHUNK} can be done in one call", 0
            return self._step(count)
        if command not in self._commands:
            return -1, f"unknown command '{command}'", 0
        self._commands[command]()
        return 1, command, 0

    def _step(self, count: int) -> Answer:
        """A fault ends the node, as it does in the simulation's own thread."""
        try:
            self._sim.step(count)
        except Exception:  # noqa: BLE001 - whatever it is, the world is not what it should be
            rospy.logfatal("The simulation failed:\n%s", traceback.format_exc())
            rospy.signal_shutdown("the simulation failed")
            return 0, "the simulation failed; its log says why", 0
        return 1, "step", count
