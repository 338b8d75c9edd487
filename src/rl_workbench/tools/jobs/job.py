"""A job: one training as a command, with its flags, its seed and its folder. It may be run more than once."""

import contextlib
import random
import shutil
import socket
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rl_workbench.errors import WorkbenchError
from rl_workbench.storage import as_json, write_file
from rl_workbench.tools.runs.runs import SUMMARY, cost_file, cost_of, read_leniently
from rl_workbench.training import folder as run_folder
from rl_workbench.training.checkpoints import LAST

MASTERS = range(
    30000, 32768
)  # ports; those above are the kernel's to give, those below `ws`'s and Ray's
# One core each; the networks are too small to gain by more.
ONE_CORE = {"OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}


@dataclass(frozen=True)
class Job:
    """One training: complete, it is skipped; half done, it goes on to the same bits, wherever it is run."""

    name: str  # for the user
    folder: Path  # of the run; results come home into it
    flags: tuple[str, ...]  # of `train`, all but --run-dir

    @property
    def log(self) -> Path:
        """What the training said."""
        return log_of(self.folder)

    def summary(self) -> dict[str, Any]:
        """What the run wrote at its end; empty if it has none."""
        return read_leniently(self.folder / SUMMARY)

    def is_done(self) -> bool:
        """Whether there is nothing left to train."""
        return bool(self.summary().get("complete"))


@dataclass(frozen=True)
class Ending:
    """How an attempt at a job ended."""

    code: int | None = None  # the training's exit code, or minus the signal's number
    lost: str = ""  # why it was lost, though it wasn't its own fault; it is tried again
    span: tuple[float, float] | None = None  # [s since 1970]
    cpu_seconds: float = 0.0


def log_of(folder: Path) -> Path:
    """Beside a run's folder: what its training said."""
    return folder.with_name(f"{folder.name}.log")


def command(job: Job, folder: Path, program: Sequence[str]) -> list[str]:
    """What is run: a new training, or one that goes on.

    Args:
        folder: the job's, or where it lies on this machine.
        program: what starts the command line, without `train`.

    Raises:
        WorkbenchError: if another training runs there, which has outlived who started it.
    """
    begin = [*program, "train"]
    if folder.exists():
        with run_folder.held(folder):
            if (folder / LAST).exists():
                return [*begin, f"--resume={folder}"]
            shutil.rmtree(folder)  # it ended before its first checkpoint
    return [*begin, f"--run-dir={folder}", *job.flags]


def environment(modules: str) -> dict[str, str]:
    """What a training has of its own: one core, and the address of a master, since robots can't share one.

    Args:
        modules: PYTHONPATH, by which it finds them.
    """
    master = f"http://127.0.0.1:{_free_port()}"
    return {**ONE_CORE, "ROS_MASTER_URI": master, "PYTHONPATH": modules}


def _free_port() -> int:
    """One that the kernel gives to nobody who asks for any: it is needed only after some seconds."""
    for port in random.SystemRandom().sample(MASTERS, len(MASTERS)):
        with contextlib.suppress(OSError), socket.create_server(("127.0.0.1", port)):
            return port
    raise WorkbenchError("no port is free for a ROS master")


def add_cost(job: Job, ending: Ending) -> None:
    """Adds to what earlier parts of an interrupted training took."""
    if ending.span is None:
        return
    before, span = cost_of(job.folder), ending.span
    cost = {
        "command_seconds": round(before.get("command_seconds", 0.0) + span[1] - span[0], 1),
        "cpu_seconds": round(before.get("cpu_seconds", 0.0) + ending.cpu_seconds, 1),
        "spans": [*before.get("spans", []), [round(each, 1) for each in span]],
    }
    write_file(cost_file(job.folder), as_json(cost))


def last_words(log: Path) -> str:
    """The last line that a training said; empty if it said nothing."""
    try:
        with log.open("rb") as file:
            size = file.seek(0, 2)
            file.seek(max(0, size - 4096))
            text = file.read().decode(errors="replace")
    except OSError:
        return ""
    lines = [line.strip() for line in text.replace("\r", "\n").split("\n")]
    return next((line for line in reversed(lines) if line), "")
