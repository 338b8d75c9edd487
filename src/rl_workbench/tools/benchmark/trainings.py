"""Trainings as processes of their own, like a user's: several at a time, each on one core."""

import os
import shutil
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from pathlib import Path
from threading import Lock
from typing import Any

from rl_workbench.errors import WorkbenchError
from rl_workbench.tools.benchmark.suites import Variant, arguments
from rl_workbench.tools.runs.runs import SUMMARY, cost_file, cost_of, read_leniently
from rl_workbench.training.run import folder as run_folder
from rl_workbench.training.run.checkpoints import LAST
from rl_workbench.training.run.files import as_json, write_file
from rl_workbench.training.run.interrupt import Interrupt

# One core each; the networks are too small to gain by more.
ONE_CORE = {"OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
LOOK_EVERY = 0.2  # [s] at the user's Ctrl-C


@dataclass(frozen=True)
class Job:
    """One run of a benchmark."""

    variant: Variant
    seed: int
    folder: Path  # of the run

    @property
    def log(self) -> Path:
        """What the training said."""
        return self.folder.with_name(f"{self.folder.name}.log")

    def summary(self) -> dict[str, Any]:
        """What the run wrote at its end; empty if it has none."""
        return read_leniently(self.folder / SUMMARY)

    def is_done(self) -> bool:
        """Whether there is nothing left to train."""
        return bool(self.summary().get("complete"))


class Trainings:
    """Runs jobs, each as a process.

    Args:
        report: is told of the end of each.
    """

    def __init__(self, report: Callable[[str], None]) -> None:
        self._report = report
        self._lock = Lock()
        self._running: set[int] = set()  # process ids
        self._stopped = False

    def run(self, jobs: Sequence[Job], at_once: int, interrupt: Interrupt) -> None:
        """Runs what isn't done yet; ends the processes if the user interrupts.

        Raises:
            WorkbenchError: if a folder can't be written to, or another training runs in it.
        """
        open_jobs = [job for job in jobs if not job.is_done()]
        with ThreadPoolExecutor(at_once) as pool:
            futures = {pool.submit(self._train, job) for job in open_jobs}
            try:
                self._wait(futures, interrupt)
            finally:
                self._stop(interrupt)

    def _wait(self, futures: set[Future[None]], interrupt: Interrupt) -> None:
        while futures and not interrupt.requested():
            done, futures = wait(futures, LOOK_EVERY, FIRST_COMPLETED)
            for future in done:
                future.result()

    def _stop(self, interrupt: Interrupt) -> None:
        """No further process begins; those that run save what they have and end."""
        with self._lock:
            self._stopped = True
            for process in self._running:
                os.kill(process, interrupt.signal or 15)

    def _train(self, job: Job) -> None:
        try:
            job.folder.parent.mkdir(parents=True, exist_ok=True)
            with job.log.open("a", encoding="utf-8") as log:
                self._run_process(job, log)
        except OSError as error:
            raise WorkbenchError(f"can't train into {job.folder}: {error.strerror}") from error

    def _run_process(self, job: Job, log: Any) -> None:
        began = time.time()
        with self._lock:
            if self._stopped:
                return
            process = subprocess.Popen(
                command(job),
                env=os.environ | ONE_CORE | own_master(),
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
            )
            self._running.add(process.pid)
        os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOWAIT)
        with self._lock:  # its number is free again only now: nobody else's process is ended
            # wait4 tells what this one process took; getrusage knows only the sum of all.
            _, status, usage = os.wait4(process.pid, 0)
            self._running.discard(process.pid)
        process.returncode = os.waitstatus_to_exitcode(status)
        _add_cost(job, (began, time.time()), usage.ru_utime + usage.ru_stime)
        self._report(_outcome(job, process.returncode))


def _add_cost(job: Job, span: tuple[float, float], cpu_seconds: float) -> None:
    """Adds to what earlier parts of an interrupted training took."""
    before = cost_of(job.folder)
    cost = {
        "command_seconds": round(before.get("command_seconds", 0.0) + span[1] - span[0], 1),
        "cpu_seconds": round(before.get("cpu_seconds", 0.0) + cpu_seconds, 1),
        "spans": [*before.get("spans", []), [round(each, 1) for each in span]],
    }
    write_file(cost_file(job.folder), as_json(cost))


def own_master() -> dict[str, str]:
    """The address of a master of a training's own: two robots can't have the same one."""
    with socket.create_server(("127.0.0.1", 0)) as probe:
        return {"ROS_MASTER_URI": f"http://127.0.0.1:{probe.getsockname()[1]}"}


def command(job: Job) -> list[str]:
    """What is run: a new training, or one that goes on.

    Raises:
        WorkbenchError: if one runs there, which has outlived its benchmark.
    """
    begin = [sys.executable, "-m", "rl_workbench", "train"]
    if job.folder.exists():
        with run_folder.held(job.folder):
            if (job.folder / LAST).exists():
                return [*begin, f"--resume={job.folder}"]
            shutil.rmtree(job.folder)  # it ended before its first checkpoint
    return [*begin, *arguments(job.variant, job.seed, job.folder)]


def _outcome(job: Job, code: int) -> str:
    name = f"{job.variant.name}, seed {job.seed}"
    summary = job.summary()
    if code or not summary:
        return f"{name}: ended with exit code {code}, see {job.log}{_last_words(job)}"
    best = summary.get("best")
    found = f"best evaluation {best[1]:.1f} at step {best[0]}" if best else "no evaluation"
    return f"{name}: {summary['steps']} steps in {summary['seconds']:.1f} s, {found}"


def _last_words(job: Job) -> str:
    """What a training that failed said at its end."""
    lines = job.log.read_text(encoding="utf-8", errors="replace").split("\n")
    return next((f": {line}" for line in reversed(lines) if line.strip()), "")
