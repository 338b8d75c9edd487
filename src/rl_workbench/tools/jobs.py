"""A pool of jobs, their states in FOLDER/jobs.json, and the command `jobs`."""

import argparse
import contextlib
import datetime
import json
import os
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

from rl_workbench.errors import WorkbenchError
from rl_workbench.starting import Interrupt, search_path
from rl_workbench.storage import as_json, read_json, write_file
from rl_workbench.tools.job import (
    MAX_ATTEMPTS,
    TIME_TO_SAVE,
    Ending,
    Job,
    Program,
    StopWithin,
    last_words,
    outcome,
    run_here,
    steps_of,
)
from rl_workbench.tools.runs import cost_of
from rl_workbench.training.folder import is_held
from rl_workbench.training.progress import tell

NAME = "jobs.json"
WAITING, RUNNING, DONE, FAILED = "waiting", "running", "done", "failed"
STOPPED = "stopped"  # neither complete nor running
TIME_TO_END = 4.0  # [s] for all trainings after Ctrl-C


@contextlib.contextmanager
def job_pool(
    arguments: argparse.Namespace, folder: Path, interrupt: Interrupt, jobs: Sequence[Job] = ()
) -> Iterator["JobPool"]:
    """Makes the pool that a command's flags choose, on this machine or on a Ray cluster."""
    program = Program(arguments.program, search_path())
    with contextlib.ExitStack() as stack:
        if arguments.ray is None:
            run: RunJob = partial(run_here, program=program, since=time.time())
            at_once = arguments.jobs or 1
            where = f"{at_once} at a time"
        else:
            with interrupt.reading():  # an interrupted start of Ray leaves processes behind
                from rl_workbench.tools.ray_tasks import RayJobs, joined

                cluster = RayJobs(stack.enter_context(joined(arguments.ray)), folder, program)
            run, where = cluster.run, cluster.about()
            at_once = min(arguments.jobs or cluster.cpus, cluster.cpus)
            tell(where)
        yield JobPool(folder, run, at_once, interrupt, jobs, where)


def claim(folder: Path, name: str, wanted: Any, refusal: str) -> None:
    """Writes the settings of a folder's runs to a file, or refuses those that differ from the file's."""
    claimed = read_json(folder / name)
    if claimed is None:
        write_file(folder / name, as_json(wanted))
    elif claimed != json.loads(json.dumps(wanted)):
        raise WorkbenchError(f"{folder} holds {refusal}; name another folder with --out")


RunJob = Callable[[Job, StopWithin, Callable[[str], None]], Ending]
"""Runs a job to its end; the last argument receives a line for each attempt that is lost."""


@dataclass
class JobEntry:
    """A job in jobs.json."""

    name: str
    folder: str  # run folder, relative to that of jobs.json
    state: str = WAITING
    note: str = ""  # why it failed or was lost


class JobPool:
    """Runs jobs in threads, reports each end, and keeps jobs.json in the folder of all runs.

    `jobs` are those known from the beginning; `run` adds others.
    """

    def __init__(
        self,
        folder: Path,
        run: RunJob,
        at_once: int,
        interrupt: Interrupt,
        jobs: Sequence[Job] = (),
        where: str = "",
    ) -> None:
        self.at_once, self.where = at_once, where  # the latter describes the machines
        self.failure: BaseException | None = None  # it ends all jobs
        self._folder, self._run, self._interrupt = folder, run, interrupt
        self._lock = threading.Lock()
        self._total = len(jobs)
        self._entries: dict[str, JobEntry] = {}
        if not jobs:
            with contextlib.suppress(WorkbenchError):  # the list is written anew
                self._entries = {each.folder: each for each in _written(folder)}
        for each in self._entries.values():
            each.state = WAITING if each.state == RUNNING else each.state
        for job in jobs:
            self._set(job, DONE if job.is_done() else WAITING, write=False)
        self._write()

    def run_all(self, jobs: Sequence[Job]) -> None:
        """Runs independent jobs."""
        with ThreadPoolExecutor(self.at_once) as threads:
            list(threads.map(self.run, jobs))

    def run(self, job: Job, is_needed: Callable[[], bool] = lambda: True) -> str:
        """Runs a job that isn't complete in the calling thread; returns why it failed, or "" if it didn't.

        A job that is stopped, by the user or because `is_needed` (called several times a second) says so, has
        not failed.
        """
        if job.is_done():
            self._set(job, DONE)
            return ""
        if self._is_over():
            return ""

        def stop_within() -> float | None:
            if self._is_over():
                return TIME_TO_END
            return None if is_needed() else TIME_TO_SAVE

        self._set(job, RUNNING)
        try:
            ending = self._run(job, stop_within, lambda reason: self._lost(job, reason))
        except BaseException as error:
            self.failure = error
            raise
        if job.is_done() or not is_needed():
            return self._ended(job, "")
        if self._is_over():
            self._set(job, WAITING)
            return ""
        words = last_words(job.log)
        failure = f"ended with exit code {ending.code}, see {job.log}" + f": {words}" * bool(words)
        if ending.lost:
            failure = f"given up after {MAX_ATTEMPTS} attempts without progress: {ending.lost}"
        return self._ended(job, failure)

    def _is_over(self) -> bool:
        return self._interrupt.requested() or self.failure is not None

    def _lost(self, job: Job, reason: str) -> None:
        self._set(job, RUNNING, reason)
        tell(f"{job.name}: lost, retrying: {reason}")

    def _ended(self, job: Job, failure: str) -> str:
        self._set(job, FAILED if failure else DONE, failure)
        summary = job.summary()
        words = failure or ("stopped" if summary.get("steps") is None else
                            f"{summary['steps']} steps {outcome(summary)}")  # fmt: skip
        with self._lock:
            counts = Counter(each.state for each in self._entries.values())
        over = counts[DONE] + counts[FAILED]
        position = f"{over} of {self._total}" if self._total else str(over)
        failed = f", {counts[FAILED]} failed" if counts[FAILED] else ""
        tell(f"[{position}{failed}] {job.name}: {words}")
        return failure

    def _set(self, job: Job, state: str, note: str = "", write: bool = True) -> None:
        folder = os.path.relpath(job.folder, self._folder)
        with self._lock:
            self._entries[folder] = JobEntry(job.name, folder, state, note)
        if write:
            self._write()

    def _write(self) -> None:
        with self._lock:
            content = [asdict(each) for each in self._entries.values()]
            write_file(self._folder / NAME, as_json({"jobs": content}))


def _written(folder: Path) -> list[JobEntry]:
    """Returns the jobs of earlier commands."""
    content = read_json(folder / NAME)
    try:
        return [JobEntry(**each) for each in content["jobs"]]
    except (KeyError, TypeError) as error:
        raise WorkbenchError(f"{folder / NAME} isn't a list of jobs: {error}") from error


@dataclass(frozen=True)
class JobStatus:
    """The progress of a job."""

    name: str
    folder: str
    state: str  # done, running, failed, waiting or stopped
    step: int  # environment steps so far
    steps: int  # of the whole training; 0 if its length isn't counted in steps
    node: str  # the machine of the last attempt
    attempts: int
    seconds: float  # since the running attempt began; else 0
    line: str  # why it failed; else the last line of its output


def add_flags(parser: argparse.ArgumentParser) -> None:
    """Adds the flags of the command."""
    parser.add_argument("folder", type=Path, metavar="FOLDER",
                        help="folder of a benchmark or sweep; it may still be running")  # fmt: skip


def run(arguments: argparse.Namespace, interrupt: Interrupt) -> None:
    """Lists the jobs of a benchmark or a sweep; only reads files."""
    jobs = read_jobs(arguments.folder)
    width = max((len(each.name) for each in jobs), default=0)
    for each in jobs:
        steps = f"{each.step} of {each.steps}" if each.steps else str(each.step)
        parts = [f"{each.state:8}", f"{each.name:{width}}", f"{steps:>15} steps"]
        if each.state == RUNNING:
            parts.append(f"for {datetime.timedelta(seconds=int(each.seconds))} on {each.node}")
        if each.attempts > 1:
            parts.append(f"attempt {each.attempts}")
        tell("  ".join([*parts, each.line]).rstrip())
    counts = Counter(each.state for each in jobs)
    tell(f"{len(jobs)} jobs: {', '.join(f'{count} {state}' for state, count in counts.items())}")


def read_jobs(folder: Path) -> list[JobStatus]:
    """Returns the progress of a folder's jobs."""
    if not (folder / NAME).exists():
        raise WorkbenchError(
            f"{folder} has no jobs: {NAME} is in the folder of a benchmark or a sweep"
        )
    is_alive = is_held(folder)
    return [_status(folder, entry, is_alive) for entry in _written(folder)]


def _status(folder: Path, entry: JobEntry, is_alive: bool) -> JobStatus:
    run = folder / entry.folder
    job, cost = Job(entry.name, run, ()), cost_of(run)
    summary, spans = job.summary(), cost.get("spans", [])
    (step, steps), state, line = steps_of(run), entry.state, entry.note or last_words(job.log)
    if summary.get("complete"):
        step, state, line = summary["steps"], DONE, outcome(summary)
    elif state == DONE:
        line = "stopped early: its result is no longer needed"
    elif not is_alive and (state == RUNNING or step and state == WAITING):
        state = STOPPED
        line = outcome(summary) if summary.get("interrupted") else line
    seconds = round(max(time.time() - spans[-1][0], 0.0), 1) if state == RUNNING and spans else 0.0
    node = str(cost.get("node", ""))
    return JobStatus(entry.name, entry.folder, state, step, steps, node, len(spans), seconds, line)
