"""Programs that this toolkit started, found from any process of the user, and their end.

All descendants of a start carry its description in an environment variable. So they are found even if their
parent was killed, and there is no list that could be out of date.
"""

import contextlib
import json
import math
import os
import signal
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass

import psutil

from ros_calls import master as _master
from ros_utils._internal import log as _log

MARK = "ROS_UTILS_LAUNCH"  # environment variable: the starts a process belongs to, outer ones first
# roslaunch gives each of its nodes 15 s after SIGINT and 2 s after SIGTERM before it ends itself.
END_PATIENCE = {"node": 8.0, "launch": 20.0, "master": 20.0}  # [s] after SIGINT
LEFTOVERS = 3.0  # [s] instead, for processes that outlive the program itself
AFTER_TERM = 3.0  # [s]
AFTER_KILL = 2.0  # [s]
POLL = 0.05  # [s]

hurry = threading.Event()  # set: skip SIGINT


@dataclass(frozen=True)
class Start:
    """A started program and all its descendants."""

    token: str  # identifies it
    kind: str  # "master", "launch" or "node"
    label: str  # name for the user
    master: str  # address
    caller: int = 0  # id of its parent, whose end the kernel signals to it; 0: none

    def mark(self) -> str:
        """Returns the value of MARK for its processes."""
        return json.dumps([*map(asdict, _starts(os.environ.get(MARK, ""))), asdict(self)])

    @property
    def is_orphan(self) -> bool:
        """Returns whether it still runs although its caller was killed."""
        members = family(self.token).values() if self.caller else ()
        # A process that is younger than they are has the id only since the caller's end.
        eldest = min(map(_began, members), default=math.inf)
        return bool(members) and not _lives(self.caller, eldest)


def _starts(mark: str) -> list[Start]:
    try:
        return [Start(**item) for item in json.loads(mark)]
    except (ValueError, TypeError):
        return []  # not ours: nothing can be ended safely


def _lives(pid: int, until: float = math.inf) -> bool:
    """Returns whether a process of that id runs that began until a time."""
    try:
        process = psutil.Process(pid)
        return process.status() != psutil.STATUS_ZOMBIE and process.create_time() <= until
    except psutil.Error:
        return False


def _began(process: psutil.Process) -> float:
    try:
        return process.create_time()
    except psutil.Error:  # it has just ended
        return math.inf


def family(token: str) -> dict[int, psutil.Process]:
    """Returns the living processes of a start, by id. See `families`."""
    return families([token])[0]


def families(tokens: Sequence[str]) -> list[dict[int, psutil.Process]]:
    """Returns the living processes of each start, by id: those with its token, and their descendants.

    The token finds children whose parent was killed; descent finds those with a cleaned environment.
    """
    everything: dict[int, psutil.Process] = {}
    parents: dict[int, int] = {}
    marks: dict[int, str] = {}
    for process in psutil.process_iter():
        with contextlib.suppress(psutil.Error):
            everything[process.pid], parents[process.pid] = process, process.ppid()
            marks[process.pid] = process.environ().get(MARK, "")
    result = []
    for token in tokens:
        pids = {pid for pid, mark in marks.items() if token in mark}
        while grown := {pid for pid, parent in parents.items() if parent in pids} - pids:
            pids |= grown
        result.append({pid: everything[pid] for pid in pids if _lives(pid)})
    return result


def started(own: Sequence[Start]) -> list[Start]:
    """Returns what any process of this user started under this master and still runs.

    `own` are the caller's: a process whose main thread has ended, but not the others, has no environment any
    more.
    """
    starts = {start.token: start for start in own}
    for process in psutil.process_iter():
        with contextlib.suppress(psutil.Error):
            for start in _starts(process.environ().get(MARK, "")):
                starts[start.token] = start
    with contextlib.suppress(_master.MasterDown):
        return [start for start in starts.values() if _master.is_at(start.master)]
    return []


def end(starts: Sequence[Start], reap: Callable[[set[str]], bool]) -> bool:
    """Ends starts with their descendants, nodes first and the master last; returns whether nothing is left.

    Skips a start that the calling process itself descends from. `reap` collects exit codes of ended children;
    given tokens, it waits for theirs and returns whether all have come.
    """
    own_line = {process.pid for process in (psutil.Process(), *psutil.Process().parents())}
    gone = True
    members = families([start.token for start in starts])
    starts = [start for start, its in zip(starts, members, strict=True) if own_line.isdisjoint(its)]
    for kind in ("node", "launch", "master"):
        wave = [start for start in starts if start.kind == kind]
        if not wave:
            continue
        left = _end_wave(wave, END_PATIENCE[kind], reap)
        gone = reap({start.token for start in wave} - left) and gone and not left
    return gone


def end_orphans(reap: Callable[[set[str]], bool]) -> bool:
    """Waits until launches and masters with a killed caller are gone: the kernel has signalled them.

    In these seconds their master still answers. Ends those that don't end by themselves; returns whether none
    is left.
    """
    orphans = [each for each in started(()) if each.kind != "node" and each.is_orphan]
    deadline = time.monotonic() + max((END_PATIENCE[each.kind] for each in orphans), default=0.0)
    while any(each.is_orphan for each in orphans) and time.monotonic() < deadline:
        time.sleep(POLL)
    return end(orphans, reap)


def _end_wave(starts: Sequence[Start], patience: float, reap: Callable[[set[str]], bool]) -> set[str]:
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
    members = families([start.token for start in starts])
    left = {start: its for start, its in zip(starts, members, strict=True) if its}
    for start, its in left.items():
        _log.warn(f"{start.label} can't be ended: processes {sorted(its)}")
    return {start.token for start in left}


def _end_with(
    number: signal.Signals, grace: float, starts: Sequence[Start], reap: Callable[[set[str]], bool]
) -> bool:
    """Sends one signal and waits; returns whether something still runs after `grace` [s]."""
    deadline = time.monotonic() + grace
    programs: set[int] = set()  # what the starts ran at first
    signalled: set[int] = set()
    while True:
        reap(set())
        running = families([start.token for start in starts])
        if not any(running):
            return False
        tops = {pid for members in running for pid in members.keys() - _children(members)}
        programs = programs or tops
        if programs.isdisjoint(set().union(*running)):
            programs = tops
            deadline = min(deadline, time.monotonic() + LEFTOVERS)
        if time.monotonic() > deadline or (hurry.is_set() and number is signal.SIGINT):
            return True
        for members in running:
            for pid in members.keys() - signalled:
                # As Ctrl-C in a terminal: to the program's process group, which ends its own children.
                # roslaunch puts its nodes into groups of their own and ends them in order.
                if number is signal.SIGKILL or not tops.isdisjoint((pid, _group(pid))):
                    signalled.add(pid)
                    with contextlib.suppress(psutil.Error):
                        members[pid].send_signal(number)  # never reaches a new process of that id
        time.sleep(POLL)


def _children(members: dict[int, psutil.Process]) -> set[int]:
    """Returns the ids of members whose parent is one, too."""
    children = set()
    for pid, process in members.items():
        with contextlib.suppress(psutil.Error):
            if process.ppid() in members:
                children.add(pid)
    return children


def _group(pid: int) -> int:
    try:
        return os.getpgid(pid)
    except ProcessLookupError:
        return 0
