"""Records the programs that this toolkit starts, for all processes of the user, and ends them.

The starts under one master are listed in `<ROS_HOME>/ros_utils/<host>_<port>.json`. All descendants of a
start carry its token in an environment variable, so they are found even if their parent was killed.
"""

from __future__ import annotations

import contextlib
import json
import os
import re
import signal
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import psutil
import rospkg

from file_access.locks import locked_file
from ros_calls import master as _master
from ros_utils._internal import log as _log

MARK = "ROS_UTILS_LAUNCH"  # environment variable with tokens, outer starts first
# roslaunch gives each of its nodes 15 s after SIGINT and 2 s after SIGTERM before it ends itself.
PATIENCE = {"node": 8.0, "launch": 20.0, "master": 20.0}  # [s] after SIGINT
LEFTOVERS = 3.0  # [s] instead, for processes that outlive the program itself
AFTER_TERM = 3.0  # [s]
AFTER_KILL = 2.0  # [s]
POLL = 0.05  # [s]

hurry = threading.Event()  # set: skip SIGINT


@dataclass(frozen=True)
class Start:
    """A started program and all its descendants."""

    pid: int
    token: str  # value of the mark in its environment
    kind: str  # "master", "launch" or "node"
    label: str  # name for the user
    log: str | None = None
    caller: int = 0  # id of its parent, whose end the kernel signals to it; 0: none

    @property
    def is_orphan(self) -> bool:
        """Returns whether it still runs although its caller was killed."""
        if not self.caller:
            return False
        root = next((each for each in family(self.token) if each.pid == self.pid), None)
        try:
            return root is not None and root.ppid() != self.caller
        except psutil.Error:
            return False


def family(token: str) -> list[psutil.Process]:
    """Returns the living processes of a start: those with its token, and their descendants.

    The token finds children whose parent was killed; descent finds those with a cleaned environment.
    """
    everything = {process.pid: process for process in psutil.process_iter()}
    parents: dict[int, int] = {}
    found: set[int] = set()
    for pid, process in everything.items():
        with contextlib.suppress(psutil.Error):
            parents[pid] = process.ppid()
            if token in process.environ().get(MARK, "").split(":"):
                found.add(pid)
    while grown := {pid for pid, parent in parents.items() if parent in found} - found:
        found |= grown
    return [everything[pid] for pid in found if _lives(everything[pid])]


def _lives(process: psutil.Process) -> bool:
    try:
        return bool(process.status() not in (psutil.STATUS_ZOMBIE, psutil.STATUS_DEAD))
    except psutil.Error:
        return False


def list_path() -> Path:
    """Returns the file that lists the starts under the present master."""
    try:
        host, port = _master.host_and_port()
        # All names of this machine mean the same master.
        name = f"{'localhost' if _master.is_local() else host}_{port}"
    except _master.MasterDown:
        name = "unknown"
    return Path(rospkg.get_ros_home(), "ros_utils", re.sub(r"[^\w.-]", "_", name) + ".json")


def started() -> list[Start]:
    """Returns what any process of this user started under this master and may still run, oldest first."""
    with _locked():
        return _read()


def add(start: Start) -> None:
    """Lists a start."""
    _change(lambda known: [*known, start])


def _remove(tokens: set[str]) -> None:
    _change(lambda known: [start for start in known if start.token not in tokens])


def _change(edit: Callable[[list[Start]], list[Start]]) -> None:
    try:
        with _locked():
            _write(edit(_read()))
    except OSError as fault:
        _log.warn(
            f"{list_path()}: {fault.strerror}: other processes won't know what was started here"
        )


@contextlib.contextmanager
def _locked() -> Iterator[None]:
    path = list_path()
    with contextlib.ExitStack() as stack:
        # Where nothing can be written, no lock is needed.
        with contextlib.suppress(OSError):
            path.parent.mkdir(parents=True, exist_ok=True)
            stack.enter_context(locked_file(path.with_suffix(".json.lock")))
        yield


def _read() -> list[Start]:
    try:
        return [Start(**item) for item in json.loads(list_path().read_text(encoding="utf-8"))]
    except (OSError, ValueError, TypeError):
        return []  # absent, or not ours: nothing can be ended safely


def _write(known: list[Start]) -> None:
    path = list_path()
    if not known:
        path.unlink(missing_ok=True)
        return
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=".starts")
    with os.fdopen(handle, "w", encoding="utf-8") as file:
        json.dump([asdict(start) for start in known], file, indent=1)
    os.replace(temporary, path)


def end(starts: Sequence[Start], reap: Callable[[set[str]], bool]) -> bool:
    """Ends starts with their descendants, nodes first and the master last, and removes them from the list.

    Skips a start that the calling process itself descends from.

    Args:
        starts: what to end.
        reap: collects exit codes of ended children; given tokens, waits for theirs and returns whether
            all have come.

    Returns:
        Whether nothing else of them is left.
    """
    own_line = {process.pid for process in (psutil.Process(), *psutil.Process().parents())}
    gone = True
    starts = [s for s in starts if own_line.isdisjoint(each.pid for each in family(s.token))]
    for kind in ("node", "launch", "master"):
        wave = [start for start in starts if start.kind == kind]
        if not wave:
            continue
        left = _end_wave(wave, PATIENCE[kind], reap)
        ended = {start.token for start in wave} - left
        gone = reap(ended) and gone and not left
        _remove(ended)
    return gone


def end_orphans(reap: Callable[[set[str]], bool]) -> bool:
    """Waits until launches and masters with a killed caller are gone: the kernel has signalled them.

    That takes some seconds, in which their master still answers. Those that don't end by themselves are
    ended.

    Returns:
        Whether none is left.
    """
    orphans = [each for each in started() if each.kind != "node" and each.is_orphan]
    deadline = time.monotonic() + max((PATIENCE[each.kind] for each in orphans), default=0.0)
    while any(each.is_orphan for each in orphans) and time.monotonic() < deadline:
        time.sleep(POLL)
    return end(orphans, reap)


def _end_wave(
    starts: Sequence[Start], patience: float, reap: Callable[[set[str]], bool]
) -> set[str]:
    """Sends SIGINT, then SIGTERM, then SIGKILL; returns the tokens of starts that still run."""
    for number, grace in (
        (signal.SIGINT, patience),
        (signal.SIGTERM, AFTER_TERM),
        (signal.SIGKILL, AFTER_KILL),
    ):
        if hurry.is_set() and number is signal.SIGINT:
            continue
        if not _end_with(number, grace, starts, reap):
            return set()
    left = [start for start in starts if family(start.token)]
    for start in left:
        _log.warn(f"{start.label}: process {start.pid} can't be ended")
    return {start.token for start in left}


def _end_with(
    number: signal.Signals,
    grace: float,
    starts: Sequence[Start],
    reap: Callable[[set[str]], bool],
) -> bool:
    """Sends one signal and waits; returns whether something still runs after `grace` [s]."""
    deadline = time.monotonic() + grace
    signalled: set[int] = set()
    orphaned = False
    while True:
        reap(set())
        families = {start.pid: family(start.token) for start in starts}
        if not any(families.values()):
            return False
        roots = {pid for pid, each in families.items() if any(p.pid == pid for p in each)}
        if not roots and not orphaned:
            orphaned = True
            deadline = min(deadline, time.monotonic() + LEFTOVERS)
        if time.monotonic() > deadline or (hurry.is_set() and number is signal.SIGINT):
            return True
        for root, members in families.items():
            for process in members:
                # As Ctrl-C in a terminal: to the program's process group, which ends its own children.
                # roslaunch puts its nodes into groups of their own and ends them in order.
                whole = root not in roots or number is signal.SIGKILL
                if process.pid not in signalled and (whole or _group(process) == root):
                    signalled.add(process.pid)
                    with contextlib.suppress(psutil.Error):
                        process.send_signal(number)  # never reaches a new process with the same id
        time.sleep(POLL)


def _group(process: psutil.Process) -> int:
    try:
        return os.getpgid(process.pid)
    except ProcessLookupError:
        return 0
