"""Simulators and trainings over ROS, each on a master of its own, with all leftovers accounted for."""

from __future__ import annotations

import contextlib
import os
import random
import re
import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from support.ros.programs import Place, Process

BOUND = 120.0  # [s] for anything to come up, or to end
OURS = re.compile(r'File "[^"]*/(?:src|scripts|companions)/(?!\.)[^"]*"')  # of a traceback


@contextlib.contextmanager
def place(folder: Path | None = None) -> Iterator[Place]:
    """A master's address and a folder; temporary files and logs go to `folder`, if it is given."""
    made = Place()
    temporary, logs = (folder or made.folder) / "tmp", (folder or made.folder) / "log"
    temporary.mkdir()
    made.environment |= {"TMPDIR": str(temporary), "ROS_LOG_DIR": str(logs)}
    # For nodes that are modules of this folder.
    modules = [os.environ.get("PYTHONPATH", ""), str(Path(__file__).resolve().parents[2])]
    made.environment |= {"ROS_HOME": str(made.folder / "home"), "PYTHONPATH": ":".join(modules)}
    try:
        yield made
    finally:
        made.close()


def launch(where: Place, *arguments: str) -> Process:
    """roslaunch of an empty world, with what it says."""
    world = ["roslaunch", "gazebo_ros", "empty_world.launch", "gui:=false", "output:=screen"]
    return where.start(*world, *arguments)


def ended(launched: Process, where: Place) -> None:
    """Waits for its end, after which nothing of the place lives on."""
    launched.end(BOUND)
    left = where.left_after(30)
    assert not left, left


def waits(look: Callable[[], object], seconds: float = BOUND) -> bool:
    """Waits until `look` gives something true."""
    deadline = time.monotonic() + seconds
    while not look():
        if time.monotonic() > deadline:
            return False
        time.sleep(0.02)
    return True


def pid_of(where: Place, words: str) -> int:
    """The process with these words in its command line; it may be about to start."""
    found: list[int] = []

    def look() -> bool:
        found[:] = [pid for pid, command in where.processes().items() if words in command]
        return bool(found)

    assert waits(look), f"no process {words!r} in {where.processes()}"
    return found[0]


def send(pid: int, number: signal.Signals, dice: random.Random) -> None:
    """Sends a signal; after a SIGSTOP goes on in a while."""
    with contextlib.suppress(ProcessLookupError):
        os.kill(pid, number)
        if number == signal.SIGSTOP:
            time.sleep(dice.uniform(0.0, 2.0))
            os.kill(pid, signal.SIGCONT)


def no_traceback(told: str) -> None:
    """Nothing of ours ended in one; what others' commands print when interrupted isn't ours."""
    if "Traceback" in told:
        assert not OURS.search(told), told[-4000:]


def leftovers(where: Place) -> list[str]:
    """What lies in the folder for temporary files."""
    return sorted(os.listdir(Path(where.environment["TMPDIR"])))
