"""Jobs to their end: run, shown, and written down for who looks from outside."""

import contextlib
from collections.abc import Iterable, Sequence
from pathlib import Path

from rl_workbench.starting import Interrupt
from rl_workbench.tools.jobs.display import Display
from rl_workbench.tools.jobs.job import Job
from rl_workbench.tools.jobs.ledger import Ledger
from rl_workbench.tools.jobs.machines import Machines
from rl_workbench.tools.jobs.runner import Runner, Watch


def run_jobs(
    machines: Machines,
    folder: Path,
    jobs: Iterable[Job | None],
    interrupt: Interrupt,
    known: Sequence[Job] = (),
    watches: Sequence[Watch] = (),
) -> None:
    """Runs jobs to their end, showing how they are getting on; `workbench.py jobs FOLDER` shows it, too.

    Args:
        folder: of the ledger.
        jobs: each is taken only when there is room for it.
        known: those that are known from the beginning; none: jobs come up as others end.
        watches: further ones, that are told how the jobs are getting on.

    Raises:
        WorkbenchError: if a folder can't be written to.
    """
    ledger = Ledger(folder, known)
    with contextlib.closing(ledger), contextlib.closing(Display(ledger, len(known))) as display:
        Runner(machines, ledger, display, *watches).run(jobs, interrupt)
