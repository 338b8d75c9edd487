"""A program as a process: what it is started with, where its output goes, and what can be asked of it."""

from __future__ import annotations

import contextlib
import os
import re
import shutil
import subprocess
import sys
import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import rospkg

from ros_calls import master as _master
from ros_utils._internal.processes import procfs as _procfs
from ros_utils._internal.processes import registry as _registry

# A caller that a shell put into the background ignores Ctrl-C, and so would all that it starts.
LISTENING = ("env", "--default-signal=INT")


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


def log_path(label: str, token: str) -> str:
    folder = os.path.join(rospkg.get_log_dir(), "ros_utils")
    try:
        os.makedirs(folder, exist_ok=True)
    except OSError as fault:
        raise CannotStart(
            f"{folder}: {fault.strerror}: set ROS_LOG_DIR to a folder that can be written"
        ) from fault
    return os.path.join(folder, f"{re.sub(r'[^A-Za-z0-9_.-]+', '-', label).strip('-')}-{token}.log")


def has_window() -> bool:
    return bool(os.environ.get("DISPLAY")) and shutil.which("xterm") is not None


def in_window(command: Sequence[str], label: str, status_file: str) -> list[str]:
    """The command run in an xterm, which by itself would keep the exit code to itself."""
    # A constant text: the command comes as arguments, so nothing of it is quoted or parsed.
    keep_code = '"$@"; echo $? > "$0"'
    return ["xterm", "-T", label, "-e", "/bin/sh", "-c", keep_code, status_file, *command]


def dying_with_caller() -> list[str]:
    """A prefix that has the kernel end the program when the caller is killed without a chance to do
    it."""
    # The kernel looks at the thread that started the program: in a short-lived one it would end too
    # early.
    if threading.current_thread() is not threading.main_thread() or shutil.which("setpriv") is None:
        return []
    return ["setpriv", "--pdeathsig", "TERM", "--"]


def environment(token: str) -> dict[str, str]:
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


def spawn(
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
