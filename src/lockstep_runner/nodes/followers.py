"""The script's side: nodes that follow its clock rest while it computes, and go on when it is their time."""

from __future__ import annotations

import math
import os
import socket
import tempfile
import threading
from dataclasses import dataclass, field
from pathlib import Path

from lockstep_runner import originals
from lockstep_runner.looks import LOOK, Seen
from lockstep_runner.nodes.starting import Starting
from lockstep_runner.nodes.wire import ADDRESS, Ended, Line
from lockstep_runner.notices import Notices

PATIENCE = (
    10.0  # [s of wall time] with a node that computes, or waits for something that isn't time
)


@dataclass
class _Node:
    """One node."""

    name: str
    pid: int
    line: Line
    rests: bool = False
    began: float = 0.0  # [ns of time passed] to rest
    wake: float = math.inf  # [ns of time passed]
    covered: bool = True  # waited for; not while it waits for something that isn't simulated time
    seen: Seen = field(init=False)

    def __post_init__(self) -> None:
        self.look_anew()

    def look_anew(self) -> None:
        """From now on."""
        self.seen = Seen(Path("/proc", str(self.pid)))


class Followers:
    """All nodes that follow (see clock.Others)."""

    def __init__(self, notices: Notices) -> None:
        self.passed = lambda: 0  # [ns], the clock's
        self.forget_mail = lambda node: None
        self.starting = Starting(notices)
        self._notices = notices
        self._guard = originals.Condition()
        self._nodes: dict[str, _Node] = {}
        self._folder = tempfile.TemporaryDirectory(prefix="lockstep_")
        address = str(Path(self._folder.name, "clock"))
        self._listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._listener.bind(address)
        self._listener.listen(64)
        os.environ[ADDRESS] = address
        thread = threading.Thread(target=self._accept, name="nodes under the clock", daemon=True)
        originals.start(thread)

    def has(self, node: str) -> bool:
        """Whether a node of that name follows."""
        return node in self._nodes

    def settle(self) -> None:
        """Waits until all that was started is up, and rests."""
        if self.starting.is_going_on:
            self.starting.settle(self._resting_pids)
        if self._nodes:
            self._until_all_rest()

    def next_wake(self) -> float:
        """When the first of them is to go on [ns of time passed]."""
        return min((node.wake for node in self._nodes.values()), default=math.inf)

    def wake_due(self, passed: int) -> None:
        """Lets those go on whose time has come, one after the other, until they rest again."""
        while True:
            with self._guard:
                due = [n for n in self._nodes.values() if n.rests and n.wake <= passed]
            if not due:
                return
            self._go_on(min(due, key=lambda node: (node.wake, node.name)))

    def wake(self, node: str) -> None:
        """Lets a node go on that has a message, until it rests again."""
        with self._guard:
            found = self._nodes.get(node)
        if found is None:
            self.forget_mail(node)  # it has ended
        elif found.rests:
            self._go_on(found)

    def _go_on(self, node: _Node) -> None:
        with self._guard:
            node.rests, node.wake = False, math.inf
        try:
            node.line.send(passed=self.passed() - node.began)
        except Ended:
            self._gone(node)
        self._until_all_rest()

    def _until_all_rest(self) -> None:
        deadline = originals.monotonic() + PATIENCE
        with self._guard:
            while any(node.covered and not node.rests for node in self._nodes.values()):
                originals.condition_wait(self._guard, LOOK)
                for node in self._nodes.values():
                    if node.rests or not node.covered:
                        continue
                    if node.seen.is_quiet():
                        node.covered = False  # it waits for something that isn't simulated time
                    elif originals.monotonic() > deadline:
                        node.covered = False
                        self._notices.once(
                            f"busy {node.name}",
                            f"node {node.name} has computed for {PATIENCE:g} s; time goes on without it,"
                            " so that what it does meanwhile isn't repeatable",
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
                    node.began = self.passed()
                    node.wake = math.inf if rest is None else node.began + rest
                    node.rests = node.covered = True
                    node.look_anew()
                    self._guard.notify_all()
        except (Ended, KeyError, TypeError, ValueError):
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
