"""End programs politely at first: SIGINT, then SIGTERM, then SIGKILL, each with a time limit."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable, Sequence

from ros_utils._internal import log as _log
from ros_utils._internal.processes import procfs as _procfs
from ros_utils._internal.processes.registry import Entry

# roslaunch gives each of its nodes 15 s after SIGINT and 2 s after SIGTERM before it ends itself.
PATIENCE = {"node": 8.0, "launch": 20.0, "master": 20.0}  # [s] after SIGINT
LEFTOVERS = 3.0  # [s] instead, for what outlives the program itself
AFTER_TERM = 3.0  # [s]
AFTER_KILL = 2.0  # [s]
POLL = 0.05  # [s]

hurry = threading.Event()  # set: skip the polite part


def end(entries: Sequence[Entry], reap: Callable[[], None]) -> set[str]:
    """End everything that came from these starts, all at the same time.

    Args:
        entries: what was started.
        reap: called between two looks, to collect ended children of this process.

    Returns:
        Tokens of the starts of which something still runs.
    """
    patience = max((PATIENCE[entry.kind] for entry in entries), default=0.0)
    for number, grace in (
        (signal.SIGINT, patience),
        (signal.SIGTERM, AFTER_TERM),
        (signal.SIGKILL, AFTER_KILL),
    ):
        if hurry.is_set() and number is signal.SIGINT:
            continue
        if not _end_with(number, grace, entries, reap):
            return set()
    left = {entry.token for entry in entries if _family(entry)}
    for entry in entries:
        if entry.token in left:
            _log.warn(f"{entry.label}: process {entry.pid} can't be ended")
    return left


def holds_caller(entry: Entry) -> bool:
    """True if the calling process itself came from this start: nobody may end the branch that they
    sit on."""
    return not _procfs.own_line().isdisjoint(_family(entry))


def _family(entry: Entry) -> dict[int, _procfs.Stat]:
    return _procfs.family(entry.pid, entry.start, entry.token)


def _end_with(
    number: signal.Signals, grace: float, entries: Sequence[Entry], reap: Callable[[], None]
) -> bool:
    """Send one signal and wait; True if something still runs after `grace` [s]."""
    deadline = time.monotonic() + grace
    told: set[int] = set()
    orphaned = False
    while True:
        reap()
        families = [(entry, _family(entry)) for entry in entries]
        if not any(family for _, family in families):
            return False
        if not any(_root_runs(entry, family) for entry, family in families) and not orphaned:
            orphaned = True
            deadline = min(deadline, time.monotonic() + LEFTOVERS)
        if time.monotonic() > deadline or (hurry.is_set() and number is signal.SIGINT):
            return True
        for entry, family in families:
            for pid in _addressees(entry, family, number) - told:
                told.add(pid)
                _procfs.send(pid, family[pid].start, number)
        time.sleep(POLL)


def _addressees(entry: Entry, family: dict[int, _procfs.Stat], number: signal.Signals) -> set[int]:
    """Who gets the signal: the program with its process group, which ends its own children; without
    it, all that is left.

    This is what Ctrl-C in a terminal does. roslaunch puts its nodes into groups of their own and
    ends them in order.
    """
    if _root_runs(entry, family) and number is not signal.SIGKILL:
        return {pid for pid, data in family.items() if entry.pid in (pid, data.group)}
    return set(family)


def _root_runs(entry: Entry, family: dict[int, _procfs.Stat]) -> bool:
    return entry.pid in family and family[entry.pid].start == entry.start
