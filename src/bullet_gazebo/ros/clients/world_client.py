"""The client's side of world_control.py. Imports no rospy, so that `gz` starts at once."""

from ros_calls import master

METHOD = "gazeboWorld"
CHUNK = 1000  # steps in one call, so that each call is short and an interrupted client stops it
TIMEOUT = 60.0  # [s] for one call


class ControlFailed(Exception):
    """The simulator can't be reached, or refuses; the text says which."""


class RemoteWorld:
    """The side of a client: a running simulator, by its node's name."""

    def __init__(self, node: str, master_uri: str) -> None:
        """`node` is the simulator's full name, usually /gazebo.

        Raises:
            ControlFailed: there is no master, or no such node.
        """
        self._node = node
        try:
            self._address = str(master.call_node(master_uri, "lookupNode", node))
        except master.NoAnswer as fault:
            raise ControlFailed(f"no ROS master at {master_uri}: {fault}") from fault
        except master.Refused as fault:
            raise ControlFailed(
                f"no node {node} at the master {master_uri}: is a simulator running?"
            ) from fault

    def command(self, name: str, count: int = 1) -> None:
        """Has the simulator carry out one command.

        Raises:
            ControlFailed: it doesn't answer, or refuses.
        """
        try:
            master.call_node(self._address, METHOD, name, count, timeout=TIMEOUT)
        except master.Refused as fault:
            raise ControlFailed(f"{self._node}: {fault}") from fault
        except master.BadAnswer as fault:
            raise ControlFailed(f"{self._node} doesn't know {METHOD}: {fault}") from fault
        except master.NoAnswer as fault:
            raise ControlFailed(f"{self._node} doesn't answer: {fault}") from fault

    def step(self, ticks: int) -> None:
        """Pauses the world, moves it by `ticks` steps, and returns when they are done.

        Raises:
            ControlFailed: as `command`.
        """
        while ticks > 0:
            count = min(ticks, CHUNK)
            self.command("step", count)
            ticks -= count
