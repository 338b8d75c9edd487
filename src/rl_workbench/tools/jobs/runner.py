"""Runs jobs until all are done or have failed; what is lost on the way is tried again."""

import contextlib
import time
from collections import deque
from collections.abc import Iterable, Iterator
from pathlib import Path

from rl_workbench.starting import Interrupt
from rl_workbench.tools.jobs.job import Ending, Job, add_cost, last_words
from rl_workbench.tools.jobs.machines import Machines
from rl_workbench.training.checkpoints import LAST

LOOK_EVERY = 0.2  # [s] at the user's Ctrl-C
MOST_LOST = 8  # attempts in a row that were lost before a new checkpoint
LONGEST_PAUSE = 30.0  # [s] between two attempts at a job


class Watch:
    """Who is told how jobs are getting on. This one does nothing."""

    def skipped(self, job: Job) -> None:
        """A job's turn has come, and it is done already."""

    def began(self, job: Job, node: str) -> None:
        """An attempt begins."""

    def progressed(self, job: Job, node: str) -> None:
        """A running job's files may have changed; called often."""

    def lost(self, job: Job, reason: str) -> None:
        """An attempt was lost; the job will be tried again."""

    def ended(self, job: Job, failure: str) -> None:
        """A job is over, and won't be tried again.

        Args:
            failure: in a line; empty if it is done, or was stopped.
        """

    def is_unwanted(self, job: Job) -> bool:
        """Whether a running job is to be stopped, as nobody needs what it still would find."""
        return False


class Runner:
    """Runs jobs on machines.

    Args:
        machines: this one, or a cluster.
        watches: are told how the jobs are getting on.
    """

    def __init__(self, machines: Machines, *watches: Watch) -> None:
        self._machines, self._watches = machines, watches
        self._running: set[Job] = set()
        self._unwanted: set[Job] = set()
        self._again: deque[tuple[float, Job]] = deque()  # not before this time [s]
        self._losses: dict[Job, tuple[int, object]] = {}  # in a row, and the checkpoint at the last

    def run(self, jobs: Iterable[Job | None], interrupt: Interrupt) -> None:
        """Runs what isn't done yet; ends all if the user interrupts.

        Args:
            jobs: each is taken only when there is room for it, so they may depend on those that ended.
                None: there is none at the moment, but will be after one that runs or has been lost.

        Raises:
            WorkbenchError: if a folder can't be written to.
        """
        waiting = iter(jobs)
        with contextlib.closing(self._machines):
            try:
                while not interrupt.requested():
                    is_all = self._begin(waiting)
                    if is_all and not self._running and not self._again:
                        return
                    self._look()
            finally:
                self._stop()

    def _begin(self, waiting: Iterator[Job | None]) -> bool:
        """Begins as many as there is room for; returns whether none is left that waits."""
        while self._machines.free() > 0:
            job = self._next(waiting)
            if job is None:
                return True
            if job.is_done():
                for watch in self._watches:
                    watch.skipped(job)
                continue
            node = self._machines.start(job)
            self._running.add(job)
            for watch in self._watches:
                watch.began(job, node)
        return False

    def _next(self, waiting: Iterator[Job | None]) -> Job | None:
        now = time.monotonic()
        for due, job in self._again:
            if due <= now:
                self._again.remove((due, job))
                return job
        return next(waiting, None)

    def _look(self) -> None:
        for job, ending in self._machines.wait(LOOK_EVERY, self._progressed):
            self._ended(job, ending)
        for job in self._running - self._unwanted:
            if any(watch.is_unwanted(job) for watch in self._watches):
                self._unwanted.add(job)
                self._machines.stop(job)

    def _progressed(self, job: Job, node: str) -> None:
        for watch in self._watches:
            watch.progressed(job, node)

    def _ended(self, job: Job, ending: Ending) -> None:
        self._running.discard(job)
        add_cost(job, ending)
        if job.is_done() or job in self._unwanted:
            self._over(job)
        elif not ending.lost:
            self._over(job, _failure(job, ending))
        elif self._is_hopeless(job):
            self._over(job, f"given up after {MOST_LOST} attempts without progress: {ending.lost}")
        else:
            for watch in self._watches:
                watch.lost(job, ending.lost)

    def _is_hopeless(self, job: Job) -> bool:
        """Whether it is lost again and again; if not, it will be tried again."""
        count, before = self._losses.get(job, (0, None))
        newest = _newest(job.folder)
        count = count + 1 if newest == before else 1
        self._losses[job] = (count, newest)
        if count >= MOST_LOST:
            return True
        self._again.append((time.monotonic() + min(2.0 ** (count - 1), LONGEST_PAUSE), job))
        return False

    def _over(self, job: Job, failure: str = "") -> None:
        self._unwanted.discard(job)
        for watch in self._watches:
            watch.ended(job, failure)

    def _stop(self) -> None:
        """Gives those that run a moment to save what they have."""
        for job in self._running:
            self._machines.stop(job)
        until = time.monotonic() + self._machines.time_to_save
        while self._running and time.monotonic() < until:
            for job, ending in self._machines.wait(LOOK_EVERY, self._progressed):
                self._running.discard(job)
                add_cost(job, ending)


def _newest(folder: Path) -> object:
    """Something that changes with each new checkpoint."""
    try:
        status = (folder / LAST).stat()
    except OSError:
        return None
    return status.st_ino, status.st_mtime_ns


def _failure(job: Job, ending: Ending) -> str:
    words = last_words(job.log)
    code = f"ended with exit code {ending.code}, see {job.log}"
    return f"{code}: {words}" if words else code
