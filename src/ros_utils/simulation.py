"""A simulator with a master of its own, as a handle.

Several can run side by side, in one process or many::

    with Simulation(lockstep=True) as simulation:
        with simulation.active():
            ros_gazebo.gazebo_spawn_urdf_path("robot.urdf", "robot")
        subprocess.run(["python3", "client.py"], env=simulation.environment())

rospy knows one master per process, so this process's publishers and subscribers belong to ROS_MASTER_URI's;
within `active`, the functions of this package use the simulation's master.
"""

import contextlib
import os
import socket
from typing import Any

from ros_calls import master as _master
from ros_utils import ros_gazebo, ros_node
from ros_utils._internal.programs import Started

LOOPBACK = "127.0.0.1"


class CannotSimulate(Exception):
    """The simulator didn't come up; the text says where to look."""


def reserved_port() -> int:
    """Returns a free TCP port on this machine's loopback, reserved for about a minute.

    A closed connection to it keeps the kernel from giving it to programs that ask for any free port;
    a server that names it, as a ROS master does, still gets it.
    """
    with socket.socket() as listener, socket.socket() as client:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind((LOOPBACK, 0))
        listener.listen(1)
        client.connect(listener.getsockname())
        accepted, _ = listener.accept()
        with contextlib.closing(accepted):
            return int(listener.getsockname()[1])


class Simulation:
    """A running simulator: master, Gazebo-like server, and everything started under them.

    Args:
        port: The master's port; None for a free one.
        gui: With a window.
        timeout: Limit of the wait for an answer [s].
        launch: Further arguments of `ros_gazebo.launch_Gazebo`, e.g. ``lockstep=True``.

    Raises:
        CannotSimulate: The port is in use, or the simulator doesn't come up.
    """

    def __init__(
        self, *, port: int | None = None, gui: bool = False, timeout: float = 30.0, **launch: Any
    ) -> None:
        self.master_uri = f"http://{LOOPBACK}:{reserved_port() if port is None else port}"
        with self.active():
            if _master.is_up():
                raise CannotSimulate(f"there is a master at {self.master_uri} already")
            arguments = {"launch_new_term": False, "output": "log", **launch}
            started = ros_gazebo.launch_Gazebo(
                gui=gui, timeout=timeout, env={"ROS_IP": LOOPBACK}, **arguments
            )
        if not isinstance(started, Started):
            raise CannotSimulate(f"no simulator at {self.master_uri}; the log says why")
        self._started = started
        self._closed = False

    @property
    def log_file(self) -> str | None:
        """Path of the output of master and simulator."""
        return self._started.log_file

    @property
    def running(self) -> bool:
        """True while master and simulator run."""
        return self._started.running

    def active(self) -> contextlib.AbstractContextManager[None]:
        """Returns a block in which the functions of this package use this simulator."""
        return _master.using(self.master_uri)

    def environment(self) -> dict[str, str]:
        """Returns the environment for a process that uses this simulator."""
        return {**os.environ, "ROS_MASTER_URI": self.master_uri, "ROS_IP": LOOPBACK}

    def model_names(self) -> list[str]:
        """Returns the names of the models in the world."""
        with self.active():
            return ros_gazebo.gazebo_get_model_names()

    def close(self) -> bool:
        """Ends the simulator, its master, and everything started under it; a second call does nothing.

        Returns True if nothing is left.
        """
        if self._closed:  # another master may use the port by now
            return True
        with self.active():
            anything = self.running or _master.is_up()
            self._closed = not anything or ros_node.ros_kill_all_processes()
        return self._closed

    def __enter__(self) -> "Simulation":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
