"""A running simulator for stress tests: its models, its resources, whether it serves."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from gazebo_msgs.srv import DeleteModel, GetModelState, GetWorldProperties, SpawnModel
from geometry_msgs.msg import Pose
from support.ros.programs import Place, Process
from support.stress.connections import SERVICE, Address, address
from support.stress.places import BOUND, OURS, ended, launch, leftovers, pid_of, place, waits

from ros_calls import master
from ros_calls.service import ServiceClient, ServiceFailed


class Usage(NamedTuple):
    """What a process takes: memory [MiB], threads, open files, entries of its temporary folder."""

    memory: float
    threads: int
    files: int
    temporary: int

    def __str__(self) -> str:
        return (
            f"{self.memory:.0f} MiB, {self.threads} threads, {self.files} files, {self.temporary} temporary"
        )


class World:
    """A simulator on a master of its own, launched by roslaunch; if it `complains`, it may in tracebacks."""

    def __init__(self, where: Place, launched: Process, complains: bool = False) -> None:
        self.place, self.launched, self._complains = where, launched, complains
        self.pid = pid_of(where, "/gzserver ")
        self.uri = where.environment["ROS_MASTER_URI"]

    def wait(self) -> None:
        """Until its services answer."""
        assert waits(self._answers), self.launched.output[-4000:]

    def _answers(self) -> bool:
        assert self.is_alive(), self.launched.output[-4000:]
        try:
            return bool(self.models())
        except ServiceFailed:
            return False

    def active(self) -> contextlib.AbstractContextManager[None]:
        """A block, for one thread, in which calls of `ros_calls` and `ros_utils` go to it."""
        return master.using(self.uri)

    def doors(self) -> tuple[Address, Address]:
        """Where clients connect: TCPROS of a service, and the node's XML-RPC."""
        service, node = master.call("lookupService", SERVICE), master.call("lookupNode", "/gazebo")
        return address(service), address(node)

    def call(self, name: str, kind: Any, *fields: Any) -> Any:
        """Calls one of Gazebo's services."""
        with self.active():
            return ServiceClient(f"/gazebo/{name}", kind, timeout=BOUND)(*fields)

    def models(self) -> list[str]:
        """The names of the models."""
        return list(self.call("get_world_properties", GetWorldProperties).model_names)

    def time(self) -> float:
        """The simulated time [s]."""
        return float(self.call("get_world_properties", GetWorldProperties).sim_time)

    def spawn(self, name: str, xml: str, sdf: bool = False, height: float = 1.0) -> Any:
        """Spawns a model; returns the answer."""
        pose = Pose()
        pose.position.z, pose.orientation.w = height, 1.0
        service = "spawn_sdf_model" if sdf else "spawn_urdf_model"
        return self.call(service, SpawnModel, name, xml, "", pose, "world")

    def delete(self, name: str) -> Any:
        """Deletes a model; returns the answer."""
        return self.call("delete_model", DeleteModel, name)

    def usage(self) -> Usage:
        """Of the simulator's process, now."""
        proc = Path(f"/proc/{self.pid}")
        memory = int((proc / "statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
        return Usage(
            memory / 2**20,
            len(list((proc / "task").iterdir())),
            len(list((proc / "fd").iterdir())),
            len(leftovers(self.place)),
        )

    def usage_again(self, before: Usage) -> Usage:
        """The same, once connections that just closed are gone: no more of anything, but for memory."""
        waits(lambda: all(now <= old for now, old in zip(self.usage()[1:], before[1:], strict=True)), 30)
        return self.usage()

    def is_alive(self) -> bool:
        """Whether the process runs; one that has ended may wait for roslaunch to notice."""
        with contextlib.suppress(FileNotFoundError):
            return Path(f"/proc/{self.pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
        return False

    def check(self) -> None:
        """It lives, its services answer, its states are numbers, and nothing of ours ended in a traceback."""
        told = self.launched.output
        assert self.is_alive(), told[-4000:]
        for name in self.models():
            state = self.call("get_model_state", GetModelState, name, "world")
            assert state.success, state.status_message
            place = state.pose.position
            assert np.isfinite([place.x, place.y, place.z]).all(), state
        assert self._complains or "Traceback" not in told or not OURS.search(told), told[-4000:]

    def check_time(self) -> None:
        """Its time goes on by itself."""
        before = self.time()
        assert waits(lambda: self.time() > before), "time stands still"


@contextlib.contextmanager
def world(
    engine: str, *arguments: str, folder: Path | None = None, complains: bool = False
) -> Iterator[World]:
    """An empty one, from launch to a clean end with nothing left.

    If it `complains`, it may tell what it lacks in tracebacks, or end over it, but not in silence.
    """
    with place(folder) as here:
        launched = launch(here, f"physics:={engine}", *arguments)
        made = World(here, launched, complains)
        made.wait()
        yield made
        if complains and not made.is_alive():
            assert "error" in launched.output.lower(), launched.output[-4000:]
        else:
            made.check()
        launched.interrupt()
        ended(launched, here)
