"""A pool of trainings, on this machine or on a Ray cluster."""

import argparse
import contextlib
import json
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

from rl_workbench.errors import WorkbenchError
from rl_workbench.starting import Interrupt, search_path
from rl_workbench.storage import as_json, check_writable, read_json, write_file
from rl_workbench.tools.jobs import Job, Program, run_here
from rl_workbench.tools.ray_tasks import RayTasks, joined
from rl_workbench.training.folder import held
from rl_workbench.training.progress import tell

RunJob = Callable[[Job, Callable[[], bool]], str]
"""Runs a job, until a function returns True; returns why it failed, or ""."""


class Pool:
    """Runs jobs in threads and reports each end. `total` is the number of jobs, if it is known."""

    def __init__(
        self, run: RunJob, at_once: int, interrupt: Interrupt, total: int = 0, where: str = ""
    ) -> None:
        self.at_once, self.where = at_once, where  # the latter describes the machines
        self._run, self._interrupt, self._total = run, interrupt, total
        self._lock = threading.Lock()
        self._ended = self._failed = 0
        self._is_broken = False  # an error of one job ends all

    def is_over(self) -> bool:
        """Returns whether no further job begins, and those that run are stopped."""
        return self._interrupt.requested() or self._is_broken

    def map(self, function: Callable[[Any], object], items: Iterable[Any]) -> None:
        """Calls a function in threads, which may run jobs in them."""
        with ThreadPoolExecutor(self.at_once) as threads:
            list(threads.map(function, items))

    def run(self, job: Job, is_needed: Callable[[], bool] = lambda: True) -> str:
        """Runs a job that isn't complete in the calling thread; returns why it failed, or "" if it didn't.

        A job that is stopped, by the user or because `is_needed` (called several times a second) says so, has
        not failed.
        """
        if job.is_done() or self.is_over():
            with self._lock:
                self._ended += job.is_done()
            return ""
        try:
            failure = self._run(job, lambda: self.is_over() or not is_needed())
        except BaseException:
            self._is_broken = True
            raise
        if failure or job.is_done() or not self.is_over():
            self._report(job, failure)
        return failure

    def _report(self, job: Job, failure: str) -> None:
        with self._lock:
            self._ended += 1
            self._failed += bool(failure)
            position = f"{self._ended} of {self._total}" if self._total else str(self._ended)
            failed = f", {self._failed} failed" if self._failed else ""
        tell(f"[{position}{failed}] {job.name}: {failure or _outcome(job.summary())}")


@contextlib.contextmanager
def job_pool(
    arguments: argparse.Namespace, folder: Path, interrupt: Interrupt, total: int = 0
) -> Iterator[Pool]:
    """Makes the pool that a command's flags choose, on this machine or on a Ray cluster."""
    program = Program(arguments.program, search_path())
    with contextlib.ExitStack() as stack:
        if arguments.ray is None:
            run: RunJob = partial(run_here, program=program)
            at_once = arguments.jobs or 1
            where = f"{at_once} at a time"
        else:
            with interrupt.reading():  # an interrupted start of Ray leaves processes behind
                cluster = RayTasks(stack.enter_context(joined(arguments.ray)), folder, program)
            run, where = cluster.run, cluster.about
            at_once = min(arguments.jobs or cluster.cpus, cluster.cpus)
            tell(where)
        yield Pool(run, at_once, interrupt, total, where)


@contextlib.contextmanager
def claimed(record: Path, wanted: Any, what: str) -> Iterator[Path]:
    """Holds the folder of a command's trainings, whose settings it records; refuses that of other ones."""
    check_writable(record)
    folder = record.parent
    with held(folder, f"another {what}"):
        found = read_json(record)
        other = "something else" if found is None and any(folder.iterdir()) else ""
        if found not in (None, json.loads(json.dumps(wanted))):
            other = f"a {what} with other options"
        if other:
            raise WorkbenchError(f"{folder} holds {other}; name another folder with --out")
        write_file(record, as_json(wanted))
        yield folder


def _outcome(summary: dict[str, Any]) -> str:
    if "steps" not in summary:
        return "stopped"
    best = summary.get("best")
    text = f"best evaluation {best[1]:.1f} at step {best[0]}" if best else "no evaluation"
    return f"{summary['steps']} steps in {summary['seconds']:.1f} s, {text}"
