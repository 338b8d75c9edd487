"""A training as a job: a process that is started, watched, stopped and resumed.

FOLDER/NAME             the run folder
FOLDER/NAME.log         the output of its training
FOLDER/NAME.cost.json   when and where each attempt ran, and what it took
"""

import contextlib
import os
import shutil
import signal
import socket
import subprocess
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from rl_workbench.errors import WorkbenchError
from rl_workbench.starting import JOB
from rl_workbench.storage import CONFIG_RECORD, as_json, write_file
from rl_workbench.tools.runs import SUMMARY, cost_file, cost_of, read_leniently
from rl_workbench.training import folder as run_folder
from web_viewer.table import NAME as SCALARS

POLL = 0.2  # [s]
TIME_TO_SAVE = 60.0  # [s] for a training that is stopped early because it is no longer needed
MAX_PAUSE = 30.0  # [s] between two attempts
MAX_ATTEMPTS = 8  # lost in a row without a new checkpoint
TAIL = 4096  # [bytes] at the end of a file, enough for its last line
# The networks are too small to gain from more cores.
ONE_CORE = {"OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
# The process was killed from outside, as by the kernel when memory is short: the training is retried.
KILLED = {-signal.SIGKILL, -signal.SIGTERM, 128 + signal.SIGTERM}

StopWithin = Callable[[], float | None]
"""Says how long a training may take to save and end [s]; None: it keeps running."""


@dataclass(frozen=True)
class Job:
    """One training. A complete one is skipped; an incomplete one is resumed, bit-identical."""

    name: str  # for the user
    folder: Path  # of the run
    flags: tuple[str, ...]  # of `train`, all but --run-dir

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


class Ending(NamedTuple):
    """How an attempt at a training ended."""

    code: int | None = None  # exit code, or minus the number of the signal
    lost: str = ""  # why the attempt failed through no fault of the training, so that it is retried


def run_attempt(
    job: Job, program: Program, stop_within: StopWithin, since: float, death_signal: str = "TERM"
) -> Ending:
    """Runs a training as a child process, which ends with this one; resumes it if it has a checkpoint.

    `stop_within` is called several times a second; a KeyboardInterrupt stops the training, too. `since` is
    when the command began [s since 1970]: earlier attempts don't count as lost. `death_signal` is sent to the
    training if this process is killed.
    """
    spans = cost_of(job.folder).get("spans", [])
    lost = _lost_attempts(job, since)
    # Memory or the folder may be free after a pause.
    until = time.monotonic() + (min(2.0 ** (lost - 1), MAX_PAUSE) if lost else 0.0)
    while time.monotonic() < until:
        if stop_within() is not None:
            return Ending()
        time.sleep(POLL)
    try:
        job.folder.parent.mkdir(parents=True, exist_ok=True)
        words = command(job, program.words)
        process = _start(words, job.log, program.modules, death_signal)
    except WorkbenchError as error:
        _note(job, spans, time.time())
        return Ending(lost=str(error))
    except OSError as error:
        raise WorkbenchError(f"can't train into {job.folder}: {error.strerror}") from error
    began = time.time()
    _note(job, spans, began)
    code, cpu_seconds, was_stopped = _finish(process, stop_within)
    _note(job, spans, began, time.time(), cpu_seconds)
    return Ending(code, "its process was killed" if code in KILLED and not was_stopped else "")


def run_here(
    job: Job, stop_within: StopWithin, say: Callable[[str], None], program: Program, since: float
) -> Ending:
    """Runs a training on this machine; one that is killed is resumed."""
    while True:
        ending = run_attempt(job, program, stop_within, since)
        if not ending.lost or is_hopeless(job, since):
            return ending
        say(ending.lost)


def is_hopeless(job: Job, since: float) -> bool:
    """Returns whether MAX_ATTEMPTS attempts in a row were lost, so that another one is useless."""
    return _lost_attempts(job, since) >= MAX_ATTEMPTS


def _lost_attempts(job: Job, since: float) -> int:
    """Returns how many attempts have begun since the last checkpoint, or since the command began."""
    from rl_workbench.training.checkpoints import LAST

    with contextlib.suppress(OSError):
        since = max(since, (job.folder / LAST).stat().st_mtime)
    return sum(began > since for began, _ in cost_of(job.folder).get("spans", []))


def _note(
    job: Job, spans: list[list[float]], began: float, ended: float | None = None, cpu: float = 0.0
) -> None:
    """Adds an attempt to a training's cost file; one lost with its machine has no end."""
    cost = cost_of(job.folder)
    if ended is not None:
        for name, seconds in (("command_seconds", ended - began), ("cpu_seconds", cpu)):
            cost[name] = round(cost.get(name, 0.0) + seconds, 1)
    # Unrounded: attempts are compared with the moments of the command and of the checkpoint.
    cost |= {"spans": [*spans, [began, ended or began]]}
    write_file(cost_file(job.folder), as_json({**cost, "node": socket.gethostname()}))


def command(job: Job, program: Sequence[str]) -> list[str]:
    """Returns the command that starts or resumes a training."""
    from rl_workbench.training.checkpoints import LAST

    if job.folder.exists():
        with run_folder.held(job.folder):
            if (job.folder / LAST).exists():
                return [*program, "train", f"--resume={job.folder}"]
            shutil.rmtree(job.folder)  # it ended before its first checkpoint
    return [*program, "train", f"--run-dir={job.folder}", *job.flags]


def _start(words: list[str], log: Path, modules: str, death_signal: str) -> subprocess.Popen[bytes]:
    prefix = ["setpriv", "--pdeathsig", death_signal, "--"] if shutil.which("setpriv") else []
    # Ray's workers block SIGINT, and child processes would inherit that.
    before = signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
    try:
        with log.open("ab") as output:
            return subprocess.Popen(
                [*prefix, *words],
                env={**os.environ, **ONE_CORE, JOB: "1", "PYTHONPATH": modules},
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                start_new_session=True,  # Ctrl-C in the terminal must reach this process alone
            )
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _finish(process: subprocess.Popen[bytes], stop_within: StopWithin) -> tuple[int, float, bool]:
    """Waits for a training; returns its exit code, its processor time [s] and whether it was stopped."""
    deadline, was_stopped = float("inf"), False
    try:
        # wait4 reports this one process; getrusage only the sum over all children. Until then its id isn't
        # reused.
        while not (ended := os.wait4(process.pid, os.WNOHANG))[0]:
            try:
                time.sleep(POLL)
                grace = stop_within()
            except KeyboardInterrupt:  # in a worker of Ray
                grace = TIME_TO_SAVE
            if grace is not None:
                deadline = min(deadline, time.monotonic() + grace)
                if not was_stopped:
                    os.kill(process.pid, signal.SIGTERM)
                    was_stopped = True
            if time.monotonic() > deadline:
                os.killpg(process.pid, signal.SIGKILL)
    except BaseException:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        raise
    _, status, usage = ended
    process.returncode = os.waitstatus_to_exitcode(status)
    return process.returncode, usage.ru_utime + usage.ru_stime, was_stopped


def last_words(log: Path) -> str:
    """Returns the last line of a training's output; empty if there is none."""
    lines = [line.strip() for line in _tail(log).replace("\r", "\n").split("\n")]
    return next((line for line in reversed(lines) if line), "")


def _tail(path: Path) -> str:
    try:
        with path.open("rb") as file:
            file.seek(max(0, file.seek(0, 2) - TAIL))
            return file.read().decode(errors="replace")
    except OSError:
        return ""


def steps_of(folder: Path) -> tuple[int, int]:
    """Returns the last step of a run and the steps of the whole training; 0 for unknown ones."""
    run = read_leniently(folder / CONFIG_RECORD).get("run")
    length = run.get("total_timesteps") if isinstance(run, dict) else 0
    length = length if isinstance(length, int) else 0
    for row in reversed(_tail(folder / SCALARS).split("\n")[:-1]):  # the last one may be incomplete
        step, tag, *_ = *row.split(","), ""
        if step.isdigit() and "/" in tag:  # tags without a slash count episodes
            return int(step), length
    return 0, length


def outcome(summary: dict[str, Any]) -> str:
    """Returns a training's result in half a line."""
    best = summary.get("best")
    text = f"best evaluation {best[1]:.1f} at step {best[0]}" if best else "no evaluation"
    return f"in {summary['seconds']:.1f} s, {text}"
