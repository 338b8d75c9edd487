"""The client's side of world_control.py. Imports no rospy, so that `gz` starts at once."""

import xmlrpc.client
from typing import Any

METHOD = "gazeboWorld"
CHUNK = 1000  # steps in one call, so that each call is short and an interrupted client stops it
TIMEOUT = 60.0  # [s] for one call
CALLER = "/gz"


class ControlFailed(Exception):
    """The simulator can't be reached, or refuses; the text says which."""


class _Transport(xmlrpc.client.Transport):
    """XML-RPC with a time limit."""

    def make_connection(self, host: Any) -> Any:
        connection = super().make_connection(host)
        connection.timeout = TIMEOUT
        return connection


class RemoteWorld:
    """The side of a client: a running simulator, by its node's name."""

    def __init__(self, node: str, master_uri: str) -> None:
        """`node` is the simulator's full name, usually /gazebo.

        Errors: ControlFailed if there is no master, or no such node.
        """
        self._node = node
        try:
            code, _, address = _proxy(master_uri).lookupNode(CALLER, node)
        except (OSError, xmlrpc.client.Error) as error:
            raise ControlFailed(f"no ROS master at {master_uri}: {error}") from error
        if code != 1:
            raise ControlFailed(
                f"no node {node} at the master {master_uri}: is a simulator running?"
            )
        self._address = str(address)

    def command(self, name: str, count: int = 1) -> None:
        """Has the simulator carry out one command.

        Errors: ControlFailed if it doesn't answer, or refuses.
        """
        try:
            code, text, _ = getattr(_proxy(self._address), METHOD)(CALLER, name, count)
        except OSError as error:
            raise ControlFailed(f"{self._node} doesn't answer: {error}") from error
        except xmlrpc.client.Error as error:
            raise ControlFailed(f"{self._node} doesn't know {METHOD}: {error}") from error
        if code != 1:
            raise ControlFailed(f"{self._node}: {text}")

    def step(self, ticks: int) -> None:
        """Pauses the world, moves it by `ticks` steps, and returns when they are done.

        Errors: ControlFailed.
        """
        while ticks > 0:
            count = min(ticks, CHUNK)
            self.command("step", count)
            ticks -= count


def _proxy(uri: str) -> Any:
    return xmlrpc.client.ServerProxy(uri, transport=_Transport())
