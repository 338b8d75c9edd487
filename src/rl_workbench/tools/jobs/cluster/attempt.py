"""What a node does: one attempt at a job, in a worker of Ray's; the training is a process of its own."""

import os
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from rl_workbench.errors import WorkbenchError
from rl_workbench.tools.jobs.cluster.parcels import Inbox, Outbox, Parcel
from rl_workbench.tools.jobs.job import Ending, Job, command, environment, log_of
from rl_workbench.tools.jobs.process import TrainingProcess
from rl_workbench.training.cluster.scratch import scratch_folder

LOOK_EVERY = 0.5  # [s] at the training's files
GROWTH_EVERY = 5.0  # [s] at least between two parcels of tables alone
TIME_TO_SAVE = 60.0  # [s] at most, after being stopped; who can't wait ends the worker by force
TOKEN = ".seen_by_nodes"


class Home(NamedTuple):
    """The folder of all jobs, as the node has to know it."""

    folder: Path
    token: str  # in a file there: who reads it sees the same folder
    is_shared: bool | None  # None: find out


class Program(NamedTuple):
    """What starts the command line on the driver's machine."""

    words: Sequence[str]  # without `train`
    modules: str  # PYTHONPATH

    def here(self) -> "Program":
        """The same on this machine, whose own modules come first."""
        # Where Python is may differ between machines.
        own = os.environ.get("PYTHONPATH", "").split(os.pathsep)
        modules = filter(None, [*own, *self.modules.split(os.pathsep)])
        return Program([sys.executable, *self.words[1:]], os.pathsep.join(modules))


class Began(NamedTuple):
    """An attempt has begun."""

    node: str  # its id


Told = Began | Parcel | Ending


def attempt(
    job: Job, home: Home, luggage: Sequence[Any] | None, program: Program
) -> Iterator[Told]:
    """Trains, and tells what there is to be told of it, an Ending as the last.

    Args:
        luggage: references to the parcels of a half done run; None: nobody has packed them, since all
            nodes see the folder.
    """
    import ray

    node = ray.get_runtime_context().get_node_id()
    is_shared = sees(home) if home.is_shared is None else home.is_shared
    yield Began(node)
    if is_shared:
        yield from _run(job, job.folder, program.here(), None)
    elif luggage is None:
        yield Ending(lost=f"its node doesn't see {home.folder}")
    else:
        with scratch_folder("rl_workbench") as place:
            folder = place / job.folder.name
            inbox = Inbox(folder, log_of(folder))
            for each in luggage:
                inbox.take(ray.get(each))
            outbox = Outbox(folder, log_of(folder))
            for _ in outbox.pack():  # that is what home has
                pass
            yield from _run(job, folder, program.here(), outbox)


def sees(home: Home) -> bool:
    """Whether this machine sees the folder of the jobs."""
    try:
        return (home.folder / TOKEN).read_text(encoding="utf-8") == home.token
    except OSError:
        return False


def _run(job: Job, folder: Path, program: Program, outbox: Outbox | None) -> Iterator[Told]:
    """The training as a process; its files, if they are to be carried, as they are written."""
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        words = command(job, folder, program.words)
        own = environment(program.modules)
        process = TrainingProcess(words, log_of(folder), own, at_callers_end="KILL")
    except WorkbenchError as error:
        yield Ending(lost=str(error))
        return
    except OSError as error:
        yield Ending(lost=f"its node can't begin it: {error.strerror} {error.filename or ''}")
        return
    try:
        yield from _followed(process, outbox)
        ending = process.ending()
        if outbox:
            yield from outbox.pack()
        yield ending
    finally:
        if process.is_running():  # the worker is to end
            process.kill()
            process.ending()


def _followed(process: TrainingProcess, outbox: Outbox | None) -> Iterator[Told]:
    """Until the training has ended, or was stopped, which is a KeyboardInterrupt in a task of Ray's."""
    packed = time.monotonic()
    try:
        while not process.wait(LOOK_EVERY):
            is_due = time.monotonic() - packed > GROWTH_EVERY
            if outbox and (is_due or outbox.has_new_files()):
                yield from outbox.pack()
                packed = time.monotonic()
    except KeyboardInterrupt:
        process.stop()
        if not process.wait(TIME_TO_SAVE):
            process.kill()
