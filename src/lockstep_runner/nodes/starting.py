"""Processes that the script has started, until they have come to rest: no simulated time passes before."""

from __future__ import annotations

import contextlib
import os
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

from lockstep_runner import originals
from lockstep_runner.looks import LOOK, QUIET, WORKING, look_at
from lockstep_runner.notices import Notices

SITE = Path(__file__).parent.with_name("site")
PATIENCE = 30.0  # [s of wall time]


class Starting:
    """Notices that processes are started, and when they work no more."""

    def __init__(self, notices: Notices) -> None:
        self.is_going_on = False
        self._notices = notices
        self._known: set[int] = set()  # processes that were told of: they compute for themselves
        paths = [str(SITE), *filter(None, [os.environ.get("PYTHONPATH")])]
        os.environ["PYTHONPATH"] = os.pathsep.join(paths)
        begin, system = subprocess.Popen.__init__, os.system

        def popen(process: Any, *args: Any, **kwds: Any) -> None:
            begin(process, *args, **kwds)
            self.is_going_on = True

        def run(command: Any) -> int:
            self.is_going_on = True
            return system(command)

        subprocess.Popen.__init__ = popen  # type: ignore[method-assign, assignment]
        os.system = run

    def settle(self, resting: Callable[[], set[int]]) -> None:
        """Waits until none of the processes below this one works, but for those that rest by the clock."""
        self.is_going_on = False
        deadline = originals.monotonic() + PATIENCE
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
                    self._notices.once(
                        f"process {pid}",
                        f"process {pid} ({_name(pid)}) computes on its own: it isn't waited for, so that"
                        " what it tells the script isn't repeatable",
                    )


def _below() -> dict[int, tuple[str, int]]:
    """Returns state and processor time [ticks] of the processes that come of this one."""
    parents: dict[int, tuple[int, str, int]] = {}
    for entry in os.listdir("/proc"):
        look = look_at(Path("/proc", entry)) if entry.isdigit() else None
        if look is not None:
            parents[int(entry)] = look
    below = {os.getpid()}
    grown = True
    while grown:
        more = {pid for pid, (parent, _, _) in parents.items() if parent in below} - below
        below |= more
        grown = bool(more)
    below.discard(os.getpid())
    return {pid: parents[pid][1:] for pid in below if parents[pid][1] != "Z"}


def _name(pid: int) -> str:
    with contextlib.suppress(OSError):
        return Path(f"/proc/{pid}/comm").read_text().strip()
    return "ended"
