"""Programs under test, each on a master of its own, with every process accounted for."""

import contextlib
import os
import shutil
import signal
import subprocess
import tempfile
import threading
import time
import unittest
import uuid
from pathlib import Path
from typing import Any

from support.ros.calls import executable

from ros_utils.simulation import reserved_port

BOUND = 120.0  # [s] for anything that a run does on a busy machine
MARK = "CARTPOLE_TEST_RUN"
NETWORKS = {"policy_network.pth", "value_network.pth"}


def piped(*command: object, **options: Any) -> subprocess.Popen[str]:
    """A command in a session of its own, whose output and errors can be read."""
    words = [str(word) for word in command]
    if words[0] == "rosrun":
        words = [executable(*words[1:3]), *words[3:]]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | options
    return subprocess.Popen(words, text=True, start_new_session=True, **pipes)


class Place:
    """A master's address, a scratch folder, and all processes that were started for it."""

    def __init__(self, master: str | None = None) -> None:
        self.folder = Path(tempfile.mkdtemp(prefix="pg_train_"))
        self.run = self.folder / "run"
        self._mark = uuid.uuid4().hex
        master = master or f"http://127.0.0.1:{reserved_port()}"
        self.environment = os.environ | {"ROS_MASTER_URI": master, MARK: self._mark}

    def start(self, *command: str) -> "Process":
        if command[0] == "rosrun":
            command = (executable(*command[1:3]), *command[3:])
        return Process(command, self.environment, self.folder)

    def train(self, *flags: str) -> "Process":
        return self.start("rosrun", "cartpole", "pg_train.py", f"--run-dir={self.run}", *flags)

    def processes(self) -> dict[int, str]:
        """Process id and command line of all that lives of this place."""
        wanted = f"{MARK}={self._mark}".encode()
        found = {}
        for entry in Path("/proc").iterdir():
            with contextlib.suppress(OSError, ValueError):
                pid = int(entry.name)
                command = (entry / "cmdline").read_bytes().replace(b"\0", b" ").decode()
                if command and wanted in (entry / "environ").read_bytes().split(b"\0"):
                    found[pid] = command
        return found

    def left_after(self, seconds: float = BOUND) -> dict[int, str]:
        """What still lives after waiting that long for it to end."""
        deadline = time.monotonic() + seconds
        while self.processes() and time.monotonic() < deadline:
            time.sleep(0.1)
        return self.processes()

    def send_to_simulator(self, number: signal.Signals) -> None:
        pids = [pid for pid, command in self.processes().items() if "/gzserver " in command]
        assert len(pids) == 1, self.processes()
        os.kill(pids[0], number)

    def files(self) -> set[str]:
        return {path.name for path in self.run.iterdir()}

    def close(self) -> None:
        for pid in self.processes():
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        shutil.rmtree(self.folder, ignore_errors=True)


class Process:
    """A running command; collects what it says."""

    def __init__(self, command: tuple[str, ...], environment: dict, folder: Path) -> None:
        self._process = subprocess.Popen(
            command,
            env=environment,
            cwd=folder,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
        )
        self._lines: list[str] = []
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        for line in self._process.stdout:
            self._lines.append(line)

    @property
    def pid(self) -> int:
        return self._process.pid

    def send(self, number: signal.Signals) -> None:
        """To the command alone."""
        with contextlib.suppress(ProcessLookupError):
            os.kill(self._process.pid, number)

    @property
    def output(self) -> str:
        return "".join(self._lines)

    def wait_for(self, text: str, seconds: float = BOUND) -> None:
        deadline = time.monotonic() + seconds
        while text not in self.output:
            assert self._process.poll() is None, f"ended before {text!r}:\n{self.output}"
            assert time.monotonic() < deadline, f"no {text!r} in {seconds} s:\n{self.output}"
            time.sleep(0.05)

    def interrupt(self) -> None:
        """As the terminal's Ctrl-C: to the whole process group."""
        os.killpg(self._process.pid, signal.SIGINT)

    def end(self, seconds: float = BOUND) -> int:
        """Waits for the exit code."""
        code = self._process.wait(seconds)
        self._reader.join(2)
        return code


class PlaceCase(unittest.TestCase):
    """Each test has a place of its own."""

    def setUp(self) -> None:
        self.place = self.new_place()

    def new_place(self, master: str | None = None) -> Place:
        place = Place(master)
        self.addCleanup(place.close)
        return place

    def ends(self, process: Process, code: int = 0) -> str:
        """Waits for its end with that exit code, and without a traceback; returns what it said."""
        self.assertEqual(process.end(), code, process.output)
        self.assertNotIn("Traceback", process.output)
        return process.output

    def run_here(self, *command: str, code: int = 0) -> str:
        """Starts a command in the place, and waits for such an end of it."""
        return self.ends(self.place.start(*command), code)

    def assert_nothing_left(self, output: str = "") -> None:
        self.assertEqual(self.place.left_after(), {}, output)
