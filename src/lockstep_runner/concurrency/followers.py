"""Other processes under the script's clock.

Nodes that follow the clock rest while the script computes and wake when they are due. No simulated time
passes until the processes that the script has started are at rest.
"""

import atexit
import contextlib
import math
import socket
import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import psutil

from lockstep_runner import originals
from lockstep_runner.clock import Others
from lockstep_runner.concurrency.line import Line, LineEnded
from lockstep_runner.concurrency.looks import LOOK, QUIET, WORKING, Seen, look_at
from lockstep_runner.notices import tell, tell_once
from lockstep_runner.runner import ScriptRunner

STARTING_PATIENCE = 30.0  # [s of wall time]


class StartedProcesses:
    """Detects when the processes that the script has started stop working."""

    def __init__(self) -> None:
        self.is_going_on = False  # set when one is started
        self._known: set[int] = set()  # already reported: these compute on their own

    def settle(self, resting: Callable[[], set[int]]) -> None:
        """Waits until no descendant of this process works; `resting` ones may, as the clock holds them."""
        self.is_going_on = False
        deadline = originals.monotonic() + STARTING_PATIENCE
        quiet, before = 0, _below()
        while quiet < QUIET:
            originals.sleep(LOOK)
            now = _below()
            busy = {
                pid
                for pid, (state, used) in now.items()
                if state in WORKING or before.get(pid, ("", -1))[1] != used
            }
            busy -= resting() | self._known
            quiet = 0 if busy else quiet + 1
            before = now
            if busy and originals.monotonic() > deadline:
                self._known |= busy
                for pid in busy:
                    tell_once(
                        f"process {pid}",
                        f"process {pid} ({_name(pid)}) computes on its own: it isn't waited for, so that"
                        " what it tells the script isn't repeatable",
                    )


def _below() -> dict[int, tuple[str, int]]:
    """Returns state and processor time [ticks] of each living descendant, by process id."""
    children = psutil.Process().children(recursive=True)
    looks = {child.pid: look_at(Path("/proc", str(child.pid))) for child in children}
    return {pid: look for pid, look in looks.items() if look is not None and look[0] != "Z"}


def _name(pid: int) -> str:
    with contextlib.suppress(psutil.Error):
        return str(psutil.Process(pid).name())
    return "ended"


NODE_PATIENCE = 10.0  # [s of wall time] for a node that computes, or waits for anything but time


@dataclass
class _Node:
    name: str
    pid: int
    line: Line
    rests: bool = False
    began: float = 0.0  # [ns of time passed] when its rest began
    wake: float = math.inf  # [ns of time passed]
    covered: bool = True  # time waits for it; False while it waits for something other than time
    seen: Seen = field(init=False)

    def __post_init__(self) -> None:
        self.seen = Seen(Path("/proc", str(self.pid)))


class Followers(Others):
    """All nodes that follow the script's clock, which connect to the socket at `address`."""

    def __init__(self, address: str, runner: ScriptRunner) -> None:
        self._clock, self._world = runner.clock, runner.world
        self.starting = StartedProcesses()
        self._guard = originals.Condition()
        self._nodes: dict[str, _Node] = {}
        atexit.register(self._tell_of_end)
        self._listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._listener.bind(address)
        self._listener.listen(64)
        self._clock.others = self
        thread = threading.Thread(target=self._accept, name="nodes under the clock", daemon=True)
        originals.start(thread)

    def _tell_of_end(self) -> None:
        with self._guard:
            names = ", ".join(sorted(self._nodes))
        if names:
            tell(f"the script has ended, and so do the nodes that follow its clock: {names}")

    def has(self, node: str) -> bool:
        """Returns whether a node of that name follows the clock."""
        return node in self._nodes

    def settle(self) -> None:
        """Waits until all started processes are up and at rest."""
        if self.starting.is_going_on:
            self.starting.settle(self._resting_pids)
        if self._nodes:
            self._until_all_rest()

    def next_wake(self) -> float:
        """Returns the earliest wake-up time [ns of time passed]; infinity if none is due."""
        return min((node.wake for node in self._nodes.values()), default=math.inf)

    def wake_due(self, passed: int) -> None:
        """Wakes the nodes that are due, one at a time, and waits until they rest again."""
        while True:
            with self._guard:
                due = [n for n in self._nodes.values() if n.rests and n.wake <= passed]
            if not due:
                return
            self._go_on(min(due, key=lambda node: (node.wake, node.name)))

    def wake(self, node: str) -> None:
        """Wakes a node that has a message, and waits until it rests again."""
        with self._guard:
            follower = self._nodes.get(node)
        if follower is None:
            self._world.forget_mail(node)  # the node has ended
        elif follower.rests:
            self._go_on(follower)

    def _go_on(self, node: _Node) -> None:
        with self._guard:
            node.rests, node.wake = False, math.inf
        try:
            node.line.send(passed=self._clock.passed - node.began)
        except LineEnded:
            self._gone(node)
        self._until_all_rest()

    def _until_all_rest(self) -> None:
        deadline = originals.monotonic() + NODE_PATIENCE
        with self._guard:
            while any(node.covered and not node.rests for node in self._nodes.values()):
                originals.condition_wait(self._guard, LOOK)
                for node in self._nodes.values():
                    if node.rests or not node.covered:
                        continue
                    if node.seen.is_quiet():
                        node.covered = False  # it waits for something other than time
                    elif originals.monotonic() > deadline:
                        node.covered = False
                        tell_once(
                            f"busy {node.name}",
                            f"node {node.name} has computed for {NODE_PATIENCE:g} s; time continues without"
                            " it, so that what it does meanwhile isn't repeatable",
                        )

    def _accept(self) -> None:
        while True:
            connection, _ = self._listener.accept()
            thread = threading.Thread(target=self._serve, args=(Line(connection),), daemon=True)
            originals.start(thread)

    def _serve(self, line: Line) -> None:
        try:
            hello = line.receive()
            node = _Node(str(hello["node"]), int(hello["pid"]), line)
            with self._guard:
                self._nodes[node.name] = node
            while True:
                rest = line.receive()["rest"]
                with self._guard:
                    node.began = self._clock.passed
                    node.wake = math.inf if rest is None else node.began + rest
                    node.rests = node.covered = True
                    node.seen = Seen(node.seen.place)
                    self._guard.notify_all()
        except (LineEnded, KeyError, TypeError, ValueError):
            line.close()
            if "node" in locals():
                self._gone(node)

    def _gone(self, node: _Node) -> None:
        with self._guard:
            if self._nodes.get(node.name) is node:
                del self._nodes[node.name]
            self._guard.notify_all()

    def _resting_pids(self) -> set[int]:
        with self._guard:
            return {node.pid for node in self._nodes.values() if node.rests}
