"""What the user sees while jobs run: bars on a terminal, else a line for each job that ends."""

import io
import shutil
import sys
import time
from typing import Any, TextIO

from tqdm import tqdm

from rl_workbench.tools.jobs.job import Job
from rl_workbench.tools.jobs.ledger import DONE, FAILED, RUNNING, Ledger
from rl_workbench.tools.jobs.runner import Watch
from rl_workbench.tools.jobs.states import steps_of, told
from rl_workbench.training.progress import tell, writable

REFRESH = 0.5  # [s]
OTHER_LINES = 3  # of the terminal: the bar over all jobs, and what was told last


class Display(Watch):
    """One bar over all jobs and one for each that runs, or lines.

    Args:
        ledger: knows how many are done.
        total: of jobs; 0: not known.
        stream: where bars go; standard error unless told otherwise.
    """

    def __init__(self, ledger: Ledger, total: int, stream: TextIO | None = None) -> None:
        self._ledger, self._total = ledger, total
        self._stream = stream or sys.stderr or io.StringIO()
        self._shown, self._bars = 0.0, dict[Job, Any]()
        self._all: Any = None
        if self._stream.isatty():
            self._all = tqdm(total=total or None, unit="job", file=self._stream, dynamic_ncols=True)
            self._count()

    def skipped(self, job: Job) -> None:
        """See Watch."""
        self._count()

    def began(self, job: Job, node: str) -> None:
        """See Watch."""
        if self._all is None:
            return
        used = {bar.pos for bar in self._bars.values()}
        rows = shutil.get_terminal_size().lines - OTHER_LINES
        if len(used) < rows:
            self._bars[job] = tqdm(desc=job.name, total=steps_of(job.folder)[1] or None, unit="step",
                                   file=self._stream, leave=False, dynamic_ncols=True)  # fmt: skip
        self._count()

    def progressed(self, job: Job, node: str) -> None:
        """See Watch."""
        if self._all is None or time.monotonic() - self._shown < REFRESH:
            return
        self._shown = time.monotonic()
        for each, bar in self._bars.items():
            bar.n, length = steps_of(each.folder)
            bar.total = length or None
            bar.refresh()
        self._all.refresh()

    def lost(self, job: Job, reason: str) -> None:
        """See Watch."""
        self._remove(job)
        self._say(f"{job.name}: lost, and tried again: {reason}")

    def ended(self, job: Job, failure: str) -> None:
        """See Watch."""
        self._remove(job)
        summary = job.summary()
        words = failure or (told(summary) if summary.get("steps") is not None else "stopped")
        counts = self._count()
        over = counts[DONE] + counts[FAILED]
        place = f"{over} of {self._total}" if self._total else str(over)
        failed = f", {counts[FAILED]} failed" if counts[FAILED] else ""
        self._say(f"[{place}{failed}] {job.name}: {words}")

    def close(self) -> None:
        """Ends the bars."""
        for job in list(self._bars):
            self._remove(job)
        if self._all is not None:
            self._all.close()

    def _remove(self, job: Job) -> None:
        if job in self._bars:
            self._bars.pop(job).close()

    def _count(self) -> dict[str, int]:
        counts = self._ledger.counts()
        if self._all is not None:
            self._all.n = counts[DONE] + counts[FAILED]
            told = (f"{counts[state]} {state}" for state in (DONE, RUNNING, FAILED))
            self._all.set_postfix_str(", ".join(told))
        return counts

    def _say(self, text: str) -> None:
        if self._all is not None:
            self._all.write(writable(text, self._stream), file=self._stream)
        else:
            tell(text)
