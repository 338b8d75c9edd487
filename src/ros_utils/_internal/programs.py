"""Programs: start, readiness, and their end when this process exits.

Every program gets its own session: Ctrl-C in the terminal reaches only the caller, whose exit then ends the
programs in order. If the caller is killed outright, the kernel sends them SIGTERM (needs setpriv of
util-linux, and a start from the main thread). The next `ros_kill_all_processes` ends any survivors.
"""

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
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import rospkg

from ros_calls import master as _master
from ros_calls.waiting import wait_until
from ros_utils._internal import log as _log
from ros_utils._internal import processes as _processes
from ros_utils.readiness import Ready, still_missing

COLLECTED = 5.0  # [s] longest time from the end of a process's main thread to its exit code
# A caller in a shell's background ignores SIGINT, and its children would inherit that.
LISTENING = ("env", "--default-signal=INT")

_handles: "list[Handle]" = []
_owner = os.getpid()
_lock = threading.Lock()


class CannotStart(Exception):
    """The program can't be started; the text says why."""


@dataclass
class Handle:
    """A program that this process started."""

    start: _processes.Start
    process: subprocess.Popen[bytes]
    log: str | None
    status_file: str | None = None  # a terminal window writes the program's exit code here

    def exit_code(self) -> int | None:
        """Returns the program's exit code, or None while it runs."""
        code = self.process.poll()
        if code is None or self.status_file is None:
            return code
        try:
            with open(self.status_file, encoding="ascii") as file:
                return int(file.read())
        except (OSError, ValueError):
            return code or 1  # the window was closed before the program ended

    def owns(self, pid: int | None) -> bool:
        """Returns whether the process id is the program's or a descendant's."""
        return pid in _processes.family(self.start.token)

    def lines(self, part: str = "") -> list[str]:
        """Returns the log's lines that contain `part`; empty if the output went to a terminal."""
        if self.log is None:
            return []
        with open(self.log, encoding="utf-8", errors="replace") as file:
            plain = [re.sub(r"\x1b[\[\]][0-9;]*[A-Za-z]?", "", line).strip() for line in file]
        return [line for line in plain if line and part in line]

    def reason(self) -> str:
        """Returns the reason for a failure: the last error in the log, else its last lines."""
        lines = self.lines()
        errors = [line for line in lines if re.search(r"(Error|Exception|ERROR|error):", line)]
        return " | ".join(errors[-1:] or lines[-3:]) or "it said nothing"

    def where(self) -> str:
        """Returns where to find the output, for the end of a message."""
        return f" (log: {self.log})" if self.log else ""

    def end(self) -> bool:
        """Ends the program and its descendants; returns whether nothing is left."""
        return end([self.start])


class Started(int):
    """A started program. It is true and equal to True, so ``if ros_launch_…(…):`` works.

    It ends with `close` or a ``with`` block, and at the latest when this Python process exits. Without a
    handle the program ran before, and `close` doesn't end it.
    """

    _handle: Handle | None
    master_uri: str

    def __new__(cls, handle: Handle | None = None) -> "Started":
        self = super().__new__(cls, 1)
        self._handle = handle
        self.master_uri = _master.uri()
        return self

    @property
    def pid(self) -> int | None:
        """Process id; None if it wasn't started here."""
        return self._handle.process.pid if self._handle else None

    @property
    def log_file(self) -> str | None:
        """Path of its output; None for a terminal."""
        return self._handle.log if self._handle else None

    @property
    def running(self) -> bool:
        """True while the program runs."""
        return self._handle is None or self._handle.exit_code() is None

    def exit_code(self) -> int | None:
        """Returns the program's exit code; None while it runs."""
        return self._handle.exit_code() if self._handle else None

    def close(self) -> bool:
        """Ends the program and its descendants by SIGINT, then SIGTERM, then SIGKILL.

        Returns True if nothing of it is left.
        """
        if self._handle is None:
            return True
        with _master.using(self.master_uri):
            return self._handle.end()

    def __enter__(self) -> "Started":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        what = f"{self._handle.start.label}, process {self.pid}" if self._handle else "runs already"
        return f"<Started: {what}>"


def start(
    command: Sequence[str], kind: str, label: str, *, window: bool = False, screen: bool = False,
    log_file: str | None = None, env: Mapping[str, str] | None = None,
) -> Handle:  # fmt: skip
    """Starts a program in its own session; raises CannotStart if it or its log can't be opened.

    Args:
        command: The program and its arguments.
        kind: "master", "launch" or "node"; programs are ended in the order node, launch, master.
        label: The program's name for the user.
        window: Run it in an xterm if there is a display and xterm; otherwise its output goes to a file.
        screen: Its output goes to the caller's terminal instead of a file.
        log_file: The file for its output; None for one of its own in ROS's log folder.
        env: Variables in addition to the caller's.
    """
    if shutil.which(command[0]) is None:
        raise CannotStart(f"{command[0]}: no such program, or not executable")
    token = secrets.token_hex(8)
    log = log_file or (None if screen else _log_path(label, token))
    status_file = None
    bound = _dying_with_caller()
    full = [*bound, *LISTENING, *command]
    if window and not log_file and os.environ.get("DISPLAY") and shutil.which("xterm"):
        log, status_file, bound = None, _log_path(label, token) + ".status", []
        # xterm hides exit codes. The command is passed as arguments, so the shell parses none of it.
        keep_code = '"$@"; echo $? > "$0"'
        full = ["xterm", "-T", label, "-e", "/bin/sh", "-c", keep_code, status_file, *full]
    elif window and not log_file:
        _log.info(f"{label}: no display or no xterm, so its output goes to {log or 'this terminal'}")
    this = _processes.Start(token, kind, label, _master.uri(), os.getpid() if bound else 0)
    handle = Handle(this, _spawn(full, {**_environment(this), **(env or {})}, log), log, status_file)
    with _lock:
        _handles.append(handle)
    return handle


def end(starts: Sequence[_processes.Start]) -> bool:
    """Ends starts. See `processes.end`."""
    gone = _processes.end(starts, _reap)
    with _lock:
        _handles[:] = [handle for handle in _handles if handle.process.poll() is None]
    return gone


def end_orphans() -> bool:
    """Ends the launches and masters of killed callers. See `processes.end_orphans`."""
    return _processes.end_orphans(_reap)


def started() -> list[_processes.Start]:
    """Returns what runs under this master. See `processes.started`."""
    with _lock:
        own = [handle.start for handle in _handles if handle.process.poll() is None]
    return _processes.started(own)


def _reap(tokens: set[str]) -> bool:
    """Collects exit codes of ended children; returns False if one with these tokens gives none.

    On a busy machine a process's other threads may outlive its main thread for a while; until they end it has
    none.
    """
    with _lock:
        ours = [handle.process for handle in _handles if handle.start.token in tokens]
        for handle in _handles:
            handle.process.poll()
    try:
        for process in ours:
            process.wait(COLLECTED)
    except subprocess.TimeoutExpired:
        return False
    return True


def _log_path(label: str, token: str) -> str:
    folder = os.path.join(rospkg.get_log_dir(), "ros_utils")
    try:
        os.makedirs(folder, exist_ok=True)
    except OSError as fault:
        raise CannotStart(
            f"{folder}: {fault.strerror}: set ROS_LOG_DIR to a folder that can be written"
        ) from fault
    return os.path.join(folder, f"{re.sub(r'[^A-Za-z0-9_.-]+', '-', label).strip('-')}-{token}.log")


def _dying_with_caller() -> list[str]:
    """Returns a command prefix with which the kernel ends the program if the caller is killed."""
    # The kernel watches the thread that started the program; a short-lived one would end it too early.
    if threading.current_thread() is not threading.main_thread() or shutil.which("setpriv") is None:
        return []
    return ["setpriv", "--pdeathsig", "TERM", "--"]


def _environment(start: _processes.Start) -> dict[str, str]:
    """Returns the caller's environment with the start's mark, and with the caller's Python first on PATH.

    Many ROS scripts begin with ``#!/usr/bin/env python3``, and the first Python on PATH often lacks
    rospy; the caller's has it.
    """
    path = os.pathsep.join([os.path.dirname(sys.executable), os.environ.get("PATH", os.defpath)])
    return {
        **os.environ, _processes.MARK: start.mark(), "PATH": path, "PYTHONUNBUFFERED": "1",
        "ROS_MASTER_URI": start.master,
    }  # fmt: skip


def _spawn(
    command: Sequence[str], environment: Mapping[str, str], log: str | None
) -> subprocess.Popen[bytes]:
    with contextlib.ExitStack() as stack:
        try:
            output = stack.enter_context(open(log, "wb")) if log else None
            return subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=output,
                stderr=subprocess.STDOUT if output else None, env=environment,
                start_new_session=True,
            )  # fmt: skip
        except (OSError, ValueError) as fault:
            raise CannotStart(f"{command[0]}: {getattr(fault, 'strerror', None) or fault}") from fault


@atexit.register
def _end_own() -> None:
    """Ends this process's programs when it exits; a second Ctrl-C makes it quick."""
    if os.getpid() != _owner or not _handles:  # a forked child owns none of them
        return
    with contextlib.suppress(ValueError):  # outside the main thread
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda *_: _processes.hurry.set())
    end([handle.start for handle in _handles])


def await_start(
    handle: Handle,
    is_there: Callable[[], bool],
    absent: str,
    timeout: float,
    ready: Ready | None,
    may_end: bool = True,
) -> Started | bool:
    """Waits for a started program, then for its world; ends it and logs the reason if one isn't there.

    Args:
        handle: The program.
        is_there: Returns whether it can be used.
        absent: What to report if it can't in time.
        timeout: Limit of each of the waits, the second one from now on [s].
        ready: The world to wait for; None for no wait.
        may_end: Whether it may end by itself, without an error, before that.
    """
    begin = time.monotonic()

    def look() -> str:
        # Checked before `is_there`, so that a program's last act before its end isn't missed.
        ended = handle.exit_code() is not None
        return "there" if is_there() else "ended" if ended else ""

    result = wait_until(look, timeout, handle.start.label)
    fault, code = "", handle.exit_code()
    if not result:
        fault = f"{absent} after {timeout:g} s; ended it"
    elif code or (result == "ended" and not may_end):
        fault = f"ended with exit code {code}"
    if fault:
        reason = handle.reason()  # before it is told to end, and reports that
        handle.end()
        _log.error(f"{handle.start.label}: {fault}: {reason}{handle.where()}")
        return False
    return wait_for_world(Started(handle), ready, begin + timeout, timeout)


def wait_for_world(started: Started, ready: Ready | None, deadline: float, timeout: float) -> Started | bool:
    """Waits until a world is ready; ends the program if it isn't by the deadline (time.monotonic()).

    `timeout` is the wait that the error reports [s].
    """
    if ready is None:
        return started
    handle = started._handle

    def has_ended() -> bool:
        code = started.exit_code()
        # A node may have done its work and end before the rest is ready.
        return bool(code) or (code == 0 and handle is not None and handle.start.kind == "launch")

    missing = still_missing(ready, max(0.0, deadline - time.monotonic()), has_ended)
    if not missing:
        return started
    what = f"not ready after {timeout:g} s"
    if handle and has_ended():
        what = f"ended with exit code {handle.exit_code()} before it was ready: {handle.reason()}"
    label, where = (handle.start.label, handle.where()) if handle else ("the world", "")
    _log.error(f"{label}: {what}: {missing}{where}")
    started.close()
    return False
