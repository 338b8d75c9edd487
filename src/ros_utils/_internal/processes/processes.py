"""Start programs, remember them, and end them with all that came from them.

Every program gets its own session, so that a Ctrl-C in the terminal reaches only the caller, whose
exit then ends the programs in order. Should the caller be killed outright, the kernel sends them
SIGTERM (needs setpriv of util-linux, and a start from the main thread); what survives even that is
ended by the next `ros_kill_all_processes`.
"""

from __future__ import annotations

import atexit
import contextlib
import os
import secrets
import shutil
import signal
import subprocess
import threading
import time
from collections.abc import Mapping, Sequence
from types import FrameType

from ros_utils._internal import log as _log
from ros_utils._internal.processes import procfs as _procfs
from ros_utils._internal.processes import program as _program
from ros_utils._internal.processes import registry as _registry
from ros_utils._internal.processes import termination as _termination

COLLECTED = 5.0  # [s] from the end of a process's main thread to its exit code, at most

_handles: list[_program.Handle] = []
_owner = os.getpid()
_lock = threading.Lock()


def start(
    command: Sequence[str],
    kind: str,
    label: str,
    *,
    window: bool = False,
    screen: bool = False,
    log_file: str | None = None,
    env: Mapping[str, str] | None = None,
) -> _program.Handle:
    """Start a program in its own session.

    Args:
        command: the program and its arguments.
        kind: "master", "launch" or "node"; programs are ended in the order node, launch, master.
        label: what the user knows it by.
        window: run it in an xterm if there is a display and xterm is installed; otherwise its
            output goes to a file.
        screen: its output goes to the caller's terminal instead of a file.
        log_file: the file for its output; None for one of its own in ROS's log folder.
        env: variables on top of the caller's.

    Raises:
        CannotStart: no such program, or the log file can't be written.
    """
    if shutil.which(command[0]) is None:
        raise _program.CannotStart(f"{command[0]}: no such program, or not executable")
    token = secrets.token_hex(8)
    log = log_file or (None if screen else _program.log_path(label, token))
    status_file = None
    bound = _program.dying_with_caller()
    full = [*bound, *_program.LISTENING, *command]
    if window and not log_file and _program.has_window():
        log, status_file = None, _program.log_path(label, token) + ".status"
        full, bound = _program.in_window(full, label, status_file), []
    elif window and not log_file:
        _log.info(
            f"{label}: no display or no xterm, so its output goes to {log or 'this terminal'}"
        )
    process = _program.spawn(full, {**_program.environment(token), **(env or {})}, log)
    data = _procfs.stat(process.pid)
    begun = data.start if data else 0  # already over: nothing will ever have start time 0
    caller = os.getpid() if bound else 0
    entry = _registry.Entry(process.pid, begun, token, kind, label, _procfs.boot_id(), log, caller)
    handle = _program.Handle(entry, process, status_file)
    with _lock:
        _handles.append(handle)
    _registry.add(entry)
    return handle


def end(entries: Sequence[_registry.Entry]) -> bool:
    """End what was started, nodes first and the master last, and forget it.

    A start that the calling process itself came from is left alone.

    Returns:
        True if nothing else of it is left.
    """
    gone = True
    entries = [entry for entry in entries if not _termination.holds_caller(entry)]
    for kind in ("node", "launch", "master"):
        wave = [entry for entry in entries if entry.kind == kind]
        if wave:
            left = _termination.end(wave, reap)
            gone = gone and not left
            ended = {entry.token for entry in wave} - left
            gone = _collect(ended) and gone
            _registry.remove(ended)
    with _lock:
        _handles[:] = [handle for handle in _handles if handle.process.poll() is None]
    return gone


def end_orphans() -> bool:
    """Wait until the launches and masters are gone whose caller was killed: the kernel has told them.

    They take some seconds, in which their master still answers whoever starts something. What
    doesn't end by itself is ended.

    Returns:
        True if none is left.
    """
    orphans = [entry for entry in started() if entry.kind != "node" and _is_orphan(entry)]
    patience = max((_termination.PATIENCE[entry.kind] for entry in orphans), default=0.0)
    deadline = time.monotonic() + patience
    while any(map(_is_orphan, orphans)) and time.monotonic() < deadline:
        time.sleep(_termination.POLL)
    return end(orphans)


def _is_orphan(entry: _registry.Entry) -> bool:
    data = _procfs.stat(entry.pid) if entry.caller else None
    return data is not None and data.start == entry.start and data.parent != entry.caller


def _collect(tokens: set[str]) -> bool:
    """Waits for the exit codes of those that are our children; False if one doesn't come.

    The main thread's end looks like the process's in /proc, but on a busy machine other threads may
    take a while, and until then the process has no exit code.
    """
    with _lock:
        ours = [handle.process for handle in _handles if handle.entry.token in tokens]
    try:
        for process in ours:
            process.wait(COLLECTED)
    except subprocess.TimeoutExpired:
        return False
    return True


def reap() -> None:
    """Collect the exit codes of our ended children: until then they stay as zombies."""
    with _lock:
        for handle in _handles:
            handle.process.poll()


def started() -> list[_registry.Entry]:
    """What was started under this master by any process of this user, oldest first, and may still
    be running."""
    return _registry.entries()


@atexit.register
def _end_own() -> None:
    """End what this process started when it exits; a second Ctrl-C makes it quick."""
    if os.getpid() != _owner or not _handles:  # a forked child has inherited the list, not the duty
        return

    def hurry(_number: int, _frame: FrameType | None) -> None:
        _termination.hurry.set()

    with contextlib.suppress(ValueError):  # not the main thread
        signal.signal(signal.SIGINT, hurry)
        signal.signal(signal.SIGTERM, hurry)
    end([handle.entry for handle in _handles])
