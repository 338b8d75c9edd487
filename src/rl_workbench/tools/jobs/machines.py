"""Where jobs are run: what the runner asks of this machine, and of a cluster."""

import select
from collections.abc import Callable, Sequence
from typing import Protocol

from rl_workbench.errors import WorkbenchError
from rl_workbench.starting import search_path
from rl_workbench.tools.jobs.job import Ending, Job, command, environment
from rl_workbench.tools.jobs.process import TrainingProcess

SHARED, CARRIED = "shared", "carried"  # folders: seen by all nodes, or brought home
Progressed = Callable[[Job, str], None]  # is told a job, and the node that it runs on


class Machines(Protocol):
    """One or many. All calls come from one thread, the one that made it."""

    time_to_save: float  # [s] that trainings have after Ctrl-C, before they are ended

    def about(self) -> str:
        """What they are, in half a line."""
        ...

    def free(self) -> int:
        """How many jobs can be begun now."""
        ...

    def start(self, job: Job) -> str:
        """Begins an attempt at a job; returns where, as far as that is known."""
        ...

    def wait(self, seconds: float, progressed: Progressed) -> list[tuple[Job, Ending]]:
        """The attempts that have ended, once one has or the time is up.

        Args:
            progressed: is told of jobs whose files have changed, or whose node is known now.
        """
        ...

    def stop(self, job: Job) -> None:
        """Has an attempt save what it has and end; that is told by `wait`."""
        ...

    def close(self) -> None:
        """Ends at once whatever runs."""
        ...


class ThisMachine:
    """Jobs as processes of this machine's.

    Args:
        at_once: how many, each on one core.
        program: what starts the command line, without `train`.
    """

    time_to_save = 4.0

    def __init__(self, at_once: int, program: Sequence[str]) -> None:
        self._at_once, self._program = at_once, program
        self._running: dict[Job, TrainingProcess] = {}
        self._refused: list[tuple[Job, Ending]] = []  # that couldn't even begin

    def about(self) -> str:
        """See Machines."""
        return f"{self._at_once} at a time"

    def free(self) -> int:
        """See Machines."""
        return self._at_once - len(self._running)

    def start(self, job: Job) -> str:
        """See Machines."""
        try:
            job.folder.parent.mkdir(parents=True, exist_ok=True)
            words = command(job, job.folder, self._program)
            self._running[job] = TrainingProcess(words, job.log, environment(search_path()))
        except WorkbenchError as error:
            self._refused.append((job, Ending(lost=str(error))))
        except OSError as error:
            raise WorkbenchError(f"can't train into {job.folder}: {error.strerror}") from error
        return "this machine"

    def wait(self, seconds: float, progressed: Progressed) -> list[tuple[Job, Ending]]:
        """See Machines."""
        looking = select.poll()
        for process in self._running.values():
            looking.register(process.descriptor, select.POLLIN)
        ended = {found for found, _ in looking.poll(0 if self._refused else 1000 * seconds)}
        over = [job for job, process in self._running.items() if process.descriptor in ended]
        for job in self._running:
            progressed(job, "this machine")
        result = self._refused + [(job, self._running.pop(job).ending()) for job in over]
        self._refused = []
        return result

    def stop(self, job: Job) -> None:
        """See Machines."""
        if job in self._running:
            self._running[job].stop()

    def close(self) -> None:
        """See Machines."""
        for process in self._running.values():
            process.kill()
            process.ending()
        self._running.clear()
