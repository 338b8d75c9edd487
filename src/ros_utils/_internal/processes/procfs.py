"""Looks at /proc: which processes run, since when, whose children they are, and whether they carry
our mark."""

from __future__ import annotations

import os
import signal
from typing import NamedTuple

# Environment variable of everything that we start; its children inherit it.
MARK = "ROS_UTILS_LAUNCH"


class Stat(NamedTuple):
    """What /proc/<pid>/stat says about a living process."""

    parent: int
    group: int
    start: int  # [clock ticks since boot]; with the pid it names a process until the next boot


def boot_id() -> str:
    """A text that differs after every boot: start times count from the boot."""
    with open("/proc/sys/kernel/random/boot_id", encoding="ascii") as file:
        return file.read().strip()


def stat(pid: int) -> Stat | None:
    """The process's data, or None if there is none or it is only a zombie that waits to be
    reaped."""
    try:
        with open(f"/proc/{pid}/stat", encoding="utf-8", errors="replace") as file:
            # The name before the bracket may hold spaces and brackets.
            fields = file.read().rpartition(")")[2].split()
    except OSError:
        return None
    if fields[0] in "ZX":
        return None
    return Stat(parent=int(fields[1]), group=int(fields[2]), start=int(fields[19]))


def processes() -> dict[int, Stat]:
    """All living processes."""
    found = {int(name): stat(int(name)) for name in os.listdir("/proc") if name.isdigit()}
    return {pid: data for pid, data in found.items() if data is not None}


def has_mark(pid: int, token: str) -> bool:
    """True if the process was started with the token in its MARK variable (by us or by something we
    started)."""
    return any(token in mark.split(":") for mark in _started_with(pid, "environ", f"{MARK}="))


def master_uri(pid: int) -> str | None:
    """The ROS master that a process was started with, or None if it wasn't, or is another user's."""
    asked = _started_with(pid, "cmdline", "__master:=")
    asked += _started_with(pid, "environ", "ROS_MASTER_URI=")
    return asked[0] if asked else None


def _started_with(pid: int, what: str, prefix: str) -> list[str]:
    """The rests of those variables or arguments of a process that begin with `prefix`."""
    try:
        with open(f"/proc/{pid}/{what}", "rb") as file:
            texts = file.read().decode(errors="replace").split("\0")
    except OSError:  # gone, or another user's
        return []
    return [text.removeprefix(prefix) for text in texts if text.startswith(prefix)]


def family(pid: int, start: int, token: str) -> dict[int, Stat]:
    """Everything that came from one start of ours: the process itself, marked ones, and all their
    descendants.

    The mark finds children whose parent was killed; the descent finds those with a cleaned
    environment.
    """
    everything = processes()
    found = {p for p in everything if has_mark(p, token)}
    if pid in everything and everything[pid].start == start:
        found.add(pid)
    grown = True
    while grown:
        children = {p for p, data in everything.items() if data.parent in found} - found
        found |= children
        grown = bool(children)
    return {p: everything[p] for p in found}


def own_line() -> set[int]:
    """The calling process and its ancestors: they must never be ended from here."""
    line, pid = set(), os.getpid()
    while pid > 1:
        line.add(pid)
        data = stat(pid)
        pid = data.parent if data else 0
    return line


def send(pid: int, start: int, number: signal.Signals) -> None:
    """Signal exactly this process: a process that got the same id later is not touched."""
    try:
        handle = os.pidfd_open(pid)
    except OSError:
        return
    try:
        data = stat(pid)
        if data is not None and data.start == start:
            signal.pidfd_send_signal(handle, number)
    except (ProcessLookupError, PermissionError):
        pass
    finally:
        os.close(handle)
