"""A training as a process, which resumes from its last checkpoint if it was killed or stopped.

FOLDER/GROUP/seed_N             the run folder
FOLDER/GROUP/seed_N.log         the output of its training
FOLDER/GROUP/seed_N.cost.json   the processor time of its processes [s]
"""

import math
import os
import shutil
import signal
import subprocess
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from rl_workbench.errors import WorkbenchError
from rl_workbench.starting import JOB
from rl_workbench.storage import as_json, write_file
from rl_workbench.tools.runs import SUMMARY, cost_file, cost_of, read_leniently
from rl_workbench.training import folder as run_folder
from rl_workbench.training.progress import tell

POLL = 0.2  # [s]
RETRIES = 3  # of a training whose process is killed
TIME_TO_END = 10.0  # [s] for a training that is stopped
# The networks are too small to gain from more cores.
ONE_CORE = {"OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
# By the kernel, as when memory is short; by a user or a batch system.
KILLED = {-signal.SIGKILL, -signal.SIGTERM, 128 + signal.SIGTERM}


@dataclass(frozen=True)
class Job:
    """One training. A complete one is skipped; an incomplete one is resumed, bit-identical."""

    root: Path  # of all trainings
    group: str  # of seeds: a variant, or a trial
    seed: int
    flags: Sequence[str]  # of `train`: algorithm and options

    @property
    def name(self) -> str:
        """The name of the training for the user."""
        return f"{self.group}, seed {self.seed}"

    @property
    def folder(self) -> Path:
        """The run folder."""
        return self.root / self.group / f"seed_{self.seed}"

    @property
    def log(self) -> Path:
        """The file with the training's output."""
        return self.folder.with_name(f"{self.folder.name}.log")

    def summary(self) -> dict[str, Any]:
        """Returns the training's summary; empty until its end."""
        return read_leniently(self.folder / SUMMARY)

    def is_done(self) -> bool:
        """Returns whether the training is complete."""
        return bool(self.summary().get("complete"))


class Program(NamedTuple):
    """The command that starts trainings."""

    words: tuple[str, ...]  # the command line, without `train`
    modules: str  # PYTHONPATH


class Killed(Exception):
    """A training's process was killed from outside, so another attempt may succeed."""


def run_here(job: Job, is_stopped: Callable[[], bool], program: Program) -> str:
    """Runs a training on this machine; one that is killed is resumed."""
    for _ in range(RETRIES + 1):
        try:
            return attempt(job, program, is_stopped)
        except Killed as error:
            tell(f"{job.name}: {error}")
    return f"its process was killed {RETRIES + 1} times"


def attempt(job: Job, program: Program, is_stopped: Callable[[], bool]) -> str:
    """Runs a training as a child process, which ends with the calling thread; returns why it failed, or "".

    `is_stopped` is called several times a second; a KeyboardInterrupt stops the training, too.
    """
    prefix = ["setpriv", "--pdeathsig", "KILL", "--"] if shutil.which("setpriv") else []
    try:
        words = command(job, program.words)
        job.folder.parent.mkdir(parents=True, exist_ok=True)
        with job.log.open("ab") as output:
            process = subprocess.Popen(
                [*prefix, *words],
                env={**os.environ, **ONE_CORE, JOB: "1", "PYTHONPATH": program.modules},
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                start_new_session=True,  # Ctrl-C in the terminal must reach this process alone
            )
    except WorkbenchError as error:  # another training runs in its folder
        return str(error)
    except OSError as error:
        raise WorkbenchError(f"can't train into {job.folder}: {error.strerror}") from error
    code, cpu_seconds, was_stopped = _finish(process, is_stopped)
    cpu_seconds += cost_of(job.folder).get("cpu_seconds", 0.0)
    write_file(cost_file(job.folder), as_json({"cpu_seconds": round(cpu_seconds, 1)}))
    if was_stopped or job.is_done():
        return ""
    if code in KILLED:
        raise Killed("its process was killed")
    return f"ended with exit code {code}, see {job.log}: {last_words(job.log)}"


def command(job: Job, program: Sequence[str]) -> list[str]:
    """Returns the command that starts or resumes a training."""
    from rl_workbench.training.checkpoints import LAST

    if job.folder.exists():
        with run_folder.held(job.folder):
            if (job.folder / LAST).exists():
                return [*program, "train", f"--resume={job.folder}"]
            shutil.rmtree(job.folder)  # it ended before its first checkpoint
    own = f"--run-dir={job.folder}", f"--exp-name={job.group}", f"--seed={job.seed}"
    return [*program, "train", *own, *job.flags]


def _finish(process: subprocess.Popen[bytes], is_stopped: Callable[[], bool]) -> tuple[int, float, bool]:
    """Waits for a training; returns its exit code, its processor time [s] and whether it was stopped."""
    deadline = math.inf
    # wait4 reports this one process; getrusage only the sum over all children.
    while not (ended := os.wait4(process.pid, os.WNOHANG))[0]:
        try:
            time.sleep(POLL)
            must_end = is_stopped()
        except KeyboardInterrupt:  # Ray cancels a task
            must_end = True
        except BaseException:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
            raise
        if must_end and deadline == math.inf:
            deadline = time.monotonic() + TIME_TO_END
            os.kill(process.pid, signal.SIGTERM)
        if time.monotonic() > deadline:
            os.killpg(process.pid, signal.SIGKILL)
    _, status, usage = ended
    process.returncode = os.waitstatus_to_exitcode(status)
    return process.returncode, usage.ru_utime + usage.ru_stime, deadline < math.inf


def last_words(log: Path) -> str:
    """Returns the last line of a training's output; empty if there is none."""
    lines = log.read_text("utf-8", "replace").splitlines() if log.exists() else []
    return next((line.strip() for line in reversed(lines) if line.strip()), "")
