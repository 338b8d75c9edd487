"""Start programs, remember them, wait until they are ready, and end them with all that came from
them.

Every program gets its own session, so that a Ctrl-C in the terminal reaches only the caller, whose
exit then ends the programs in order. Should the caller be killed outright, the kernel sends them
SIGTERM (needs setpriv of util-linux, and a start from the main thread); what survives even that is
ended by the next `ros_kill_all_processes`.
"""

from __future__ import annotations

import atexit
import contextlib
import os
import re
import secrets
import shutil
import signal
import subprocess
import sys
import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import FrameType

import rospkg

from ros_calls import master as _master
from ros_utils._internal import log as _log
from ros_utils._internal.processes import procfs as _procfs
from ros_utils._internal.processes import registry as _registry
from ros_utils._internal.processes import termination as _termination

# A caller that a shell put into the background ignores Ctrl-C, and so would all that it starts.
LISTENING = ("env", "--default-signal=INT")
COLLECTED = 5.0  # [s] from the end of a process's main thread to its exit code, at most


class CannotStart(Exception):
    """The program can't be started; the text says why."""


@dataclass
class Handle:
    """A program that this process started."""

    entry: _registry.Entry
    process: subprocess.Popen[bytes]
    status_file: str | None = None  # where a terminal window leaves the program's exit code

    def exit_code(self) -> int | None:
        """The program's exit code, or None while it runs."""
        code = self.process.poll()
        if code is None or self.status_file is None:
            return code
        try:
            with open(self.status_file, encoding="ascii") as file:
                return int(file.read())
        except (OSError, ValueError):
            return code or 1  # the window was closed before the program ended

    def owns(self, pid: int | None) -> bool:
        """True if the process id is the program's or one of its descendants'."""
        return pid is not None and pid in _procfs.family(
            self.entry.pid, self.entry.start, self.entry.token
        )

    def lines(self, part: str = "") -> list[str]:
        """The log's lines that hold a text; none if the output went to a terminal."""
        if self.entry.log is None:
            return []
        with open(self.entry.log, encoding="utf-8", errors="replace") as file:
            plain = [re.sub(r"\x1b[\[\]][0-9;]*[A-Za-z]?", "", line).strip() for line in file]
        return [line for line in plain if line and part in line]

    def reason(self) -> str:
        """What the log gives as reason of a failure: its last error, or else its last lines."""
        lines = self.lines()
        errors = [line for line in lines if re.search(r"(Error|Exception|ERROR|error):", line)]
        return " | ".join(errors[-1:] or lines[-3:]) or "it said nothing"

    def where(self) -> str:
        """Where to read on, to be put behind a message."""
        return f" (log: {self.entry.log})" if self.entry.log else ""


_handles: list[Handle] = []
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
) -> Handle:
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
        raise CannotStart(f"{command[0]}: no such program, or not executable")
    token = secrets.token_hex(8)
    log = log_file or (None if screen else _log_path(label, token))
    status_file = None
    full = [*_dying_with_caller(), *LISTENING, *command]
    if window and not log_file and _has_window():
        log, status_file = None, _log_path(label, token) + ".status"
        full = _in_window(full, label, status_file)
    elif window and not log_file:
        _log.info(
            f"{label}: no display or no xterm, so its output goes to {log or 'this terminal'}"
        )
    process = _spawn(full, {**_environment(token), **(env or {})}, log)
    data = _procfs.stat(process.pid)
    begun = data.start if data else 0  # already over: nothing will ever have start time 0
    entry = _registry.Entry(process.pid, begun, token, kind, label, _procfs.boot_id(), log)
    handle = Handle(entry, process, status_file)
    with _lock:
        _handles.append(handle)
    _registry.add(entry)
    return handle


def _log_path(label: str, token: str) -> str:
    folder = os.path.join(rospkg.get_log_dir(), "ros_utils")
    try:
        os.makedirs(folder, exist_ok=True)
    except OSError as fault:
        raise CannotStart(
            f"{folder}: {fault.strerror}: set ROS_LOG_DIR to a folder that can be written"
        ) from fault
    return os.path.join(folder, f"{re.sub(r'[^A-Za-z0-9_.-]+', '-', label).strip('-')}-{token}.log")


def _has_window() -> bool:
    return bool(os.environ.get("DISPLAY")) and shutil.which("xterm") is not None


def _in_window(command: Sequence[str], label: str, status_file: str) -> list[str]:
    """The command run in an xterm, which by itself would keep the exit code to itself."""
    # A constant text: the command comes as arguments, so nothing of it is quoted or parsed.
    keep_code = '"$@"; echo $? > "$0"'
    return ["xterm", "-T", label, "-e", "/bin/sh", "-c", keep_code, status_file, *command]


def _dying_with_caller() -> list[str]:
    """A prefix that has the kernel end the program when the caller is killed without a chance to do
    it."""
    # The kernel looks at the thread that started the program: in a short-lived one it would end too
    # early.
    if threading.current_thread() is not threading.main_thread() or shutil.which("setpriv") is None:
        return []
    return ["setpriv", "--pdeathsig", "TERM", "--"]


def _environment(token: str) -> dict[str, str]:
    """The caller's environment, marked, and with the caller's Python first on PATH.

    Many ROS scripts begin with ``#!/usr/bin/env python3``, and the first one on PATH often has no
    rospy; ours has.
    """
    outer = os.environ.get(_procfs.MARK)
    path = os.pathsep.join([os.path.dirname(sys.executable), os.environ.get("PATH", os.defpath)])
    mark = f"{outer}:{token}" if outer else token
    return {
        **os.environ,
        _procfs.MARK: mark,
        "PATH": path,
        "PYTHONUNBUFFERED": "1",
        "ROS_MASTER_URI": _master.uri(),
    }


def _spawn(
    command: Sequence[str], environment: Mapping[str, str], log: str | None
) -> subprocess.Popen[bytes]:
    with contextlib.ExitStack() as stack:
        try:
            output = stack.enter_context(open(log, "wb")) if log else None
            return subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT if output else None,
                env=environment,
                start_new_session=True,
            )
        except (OSError, ValueError) as fault:
            raise CannotStart(
                f"{command[0]}: {getattr(fault, 'strerror', None) or fault}"
            ) from fault


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
