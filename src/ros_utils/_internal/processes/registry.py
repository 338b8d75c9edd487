"""The list of what this toolkit started under one master, shared by all processes of the user.

A JSON file `<ROS_HOME>/ros_utils/<host>_<port>.json`, read and written under a lock and replaced in
one step, so that no reader ever sees half of it.
"""

from __future__ import annotations

import contextlib
import fcntl
import json
import os
import re
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass

import rospkg

from ros_calls import master as _master
from ros_utils._internal import log as _log
from ros_utils._internal.processes import procfs as _procfs


@dataclass(frozen=True)
class Entry:
    """One process that was started, and all that came from it."""

    pid: int
    start: int  # [clock ticks since boot]
    token: str  # value of the mark in its environment
    kind: str  # "master", "launch" or "node"
    label: str  # what the user knows it by
    boot: str
    log: str | None = None
    caller: int = 0  # the process that it is a child of, and whose end the kernel tells it; 0: none


def path() -> str:
    """The file for the present master."""
    try:
        host, port = _master.host_and_port()
        # One master, whatever name of this machine is used.
        host = "localhost" if _master.is_local() else host
        name = f"{host}_{port}"
    except _master.MasterDown:
        name = "unknown"
    return os.path.join(rospkg.get_ros_home(), "ros_utils", re.sub(r"[^\w.-]", "_", name) + ".json")


def entries() -> list[Entry]:
    """What was started under this master and may still be running, oldest first."""
    with _locked():
        return _read()


def add(entry: Entry) -> None:
    """Remember a start."""
    _change(lambda known: [*known, entry])


def remove(tokens: set[str]) -> None:
    """Forget starts that have ended."""
    _change(lambda known: [entry for entry in known if entry.token not in tokens])


def _change(edit: Callable[[list[Entry]], list[Entry]]) -> None:
    try:
        with _locked():
            _write(edit(_read()))
    except OSError as fault:
        _log.warn(f"{path()}: {fault.strerror}: other processes won't know what was started here")


@contextlib.contextmanager
def _locked() -> Iterator[None]:
    folder = os.path.dirname(path())
    try:
        os.makedirs(folder, exist_ok=True)
        lock = os.open(path() + ".lock", os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
    except OSError:
        yield  # nothing can be written there, so nothing can be disturbed
        return
    try:
        # Held for milliseconds only, and freed by the kernel if its holder dies.
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield
    finally:
        os.close(lock)


def _read() -> list[Entry]:
    try:
        with open(path(), encoding="utf-8") as file:
            known = [Entry(**item) for item in json.load(file)]
    except (OSError, ValueError, TypeError):
        return []  # absent, or not ours: there is nothing that could be ended safely
    return [entry for entry in known if entry.boot == _procfs.boot_id()]


def _write(known: list[Entry]) -> None:
    target = path()
    if not known:
        with contextlib.suppress(FileNotFoundError):
            os.unlink(target)
        return
    handle, temporary = tempfile.mkstemp(dir=os.path.dirname(target), prefix=".registry")
    with os.fdopen(handle, "w", encoding="utf-8") as file:
        json.dump([asdict(entry) for entry in known], file, indent=1)
    os.replace(temporary, target)
