"""A cluster as machines for jobs: where each runs is Ray's choice, what is lost is told."""

import contextlib
import secrets
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rl_workbench.errors import WorkbenchError
from rl_workbench.starting import search_path
from rl_workbench.storage import as_text, write_file
from rl_workbench.tools.jobs.cluster.attempt import (
    TOKEN,
    Began,
    Home,
    Program,
    attempt,
    sees,
)
from rl_workbench.tools.jobs.cluster.faults import in_a_line
from rl_workbench.tools.jobs.cluster.parcels import Inbox, Outbox
from rl_workbench.tools.jobs.job import Ending, Job
from rl_workbench.tools.jobs.machines import CARRIED, SHARED, Progressed
from rl_workbench.training import folder as run_folder
from rl_workbench.training.checkpoints import LAST
from rl_workbench.training.cluster.nodes import Cluster, Node, only
from rl_workbench.training.progress import warn

UPDATE_EVERY = 5.0  # [s] of which nodes there are
PATIENCE = 60.0  # [s] for a node's answer, and for a node where none is left
AT_A_TIME = 2  # parcels of an attempt that wait in the object store
MOST_TAKEN = 64  # parcels of an attempt before the others' turn


@dataclass
class _Attempt:
    """One that runs, or waits for a node."""

    job: Job
    told: Any  # Ray's generator of what the node tells
    inbox: Inbox
    began: float  # [s since 1970]
    held: contextlib.ExitStack  # the run's folder, if its files are carried into it
    node: str = "a node that is free"


class RayNodes:
    """The nodes of a cluster.

    Args:
        cluster: that was joined.
        folder: in which all jobs' folders lie.
        program: what starts the command line, without `train`.
        at_once: how many jobs; None: as many as there are cores.
        folders: SHARED, CARRIED, or None to find out which.

    Raises:
        WorkbenchError: if the folder can't be written to.
    """

    time_to_save = 2.0  # to leave a cluster takes seconds as well

    def __init__(
        self,
        cluster: Cluster,
        folder: Path,
        program: Sequence[str],
        at_once: int | None,
        folders: str | None,
    ) -> None:
        self._cluster, self._ray, self._program = (
            cluster,
            cluster.ray,
            Program(list(program), search_path()),
        )
        self._at_once, self._running = at_once, list[_Attempt]()
        self._refused: list[tuple[Job, Ending]] = []
        is_shared = None if folders is None else folders == SHARED
        self._home = Home(folder, secrets.token_hex(8), is_shared)
        write_file(folder / TOKEN, as_text(self._home.token))
        self._task = self._ray.remote(
            num_cpus=1,
            max_retries=0,  # what is lost begins again from the newest checkpoint, see Runner
            num_returns="streaming",
            _generator_backpressure_num_objects=AT_A_TIME,
        )(attempt)
        self._blind = self._those_that_do_not_see() if is_shared is None else []
        self._is_packed = is_shared is False or bool(self._blind)
        self._updated = self._had_nodes = time.monotonic()

    def about(self) -> str:
        """See Machines."""
        nodes = self._cluster.nodes.values()
        count = (
            f"{len(nodes)} node{'s' * (len(nodes) > 1)} of Ray's with {self._cluster.cpus} cores"
        )
        at_once = f", {self._at_once} at a time" if self._at_once else ""
        return f"{count}{at_once}; {self._about_folders()}"

    def _about_folders(self) -> str:
        folder = self._home.folder
        if self._home.is_shared is not None:
            way = "shared by all nodes" if self._home.is_shared else "carried home by Ray"
            return f"folders are {way}, as --folders says"
        if not self._blind:
            return f"all see {folder}, and write there"
        names = ", ".join(self._blind)
        return f"{folder} isn't seen by {names}: what is trained there is {CARRIED} home by Ray"

    def free(self) -> int:
        """See Machines."""
        return min(self._at_once or self._cluster.cpus, self._cluster.cpus) - len(self._running)

    def start(self, job: Job) -> str:
        """See Machines."""
        held = contextlib.ExitStack()
        try:
            luggage = self._pack(job, held) if self._is_packed else None
        except WorkbenchError as error:  # another training runs there
            held.close()
            self._refused.append((job, Ending(lost=str(error))))
            return ""
        task = self._task.options(name=f"train {job.name}", **self._cluster.placement())
        told = task.remote(job, self._home, luggage, self._program)
        began = _Attempt(job, told, Inbox(job.folder, job.log), time.time(), held)
        self._running.append(began)
        return began.node

    def _pack(self, job: Job, held: contextlib.ExitStack) -> list[Any]:
        """A half done run's files, in Ray's object store."""
        if not (job.folder / LAST).exists():
            return []
        held.enter_context(run_folder.held(job.folder))
        parcels = Outbox(job.folder, log=None).pack()
        try:
            return [self._ray.put(parcel) for parcel in parcels]
        except self._ray.exceptions.RayError as error:
            raise WorkbenchError(
                f"{job.folder} finds no room in Ray's object store: {in_a_line(error)}"
            ) from error

    def wait(self, seconds: float, progressed: Progressed) -> list[tuple[Job, Ending]]:
        """See Machines."""
        self._update()
        result, self._refused = self._refused, []
        for each in self._ready(0.0 if result else seconds):
            if ending := self._take(each):
                self._running.remove(each)
                each.held.close()
                result.append((each.job, ending))
        for each in self._running:  # where folders are shared, nobody tells of files
            progressed(each.job, each.node)
        return result

    def _update(self) -> None:
        if time.monotonic() - self._updated > UPDATE_EVERY:
            self._cluster.update()
            self._updated = time.monotonic()
            if self._cluster.nodes:
                self._had_nodes = self._updated
            elif self._updated - self._had_nodes > PATIENCE:
                raise WorkbenchError(
                    f"no node can be used any more, for {PATIENCE:.0f} s now; the same command goes on"
                )

    def _ready(self, seconds: float) -> list[_Attempt]:
        """Those of which there is something to be taken, once there is one or the time is up."""
        waited = [each.told for each in self._running]
        if not waited:
            time.sleep(seconds)
            return []
        found, _ = self._ray.wait(waited, num_returns=1, timeout=seconds, fetch_local=False)
        if found:
            found, _ = self._ray.wait(waited, num_returns=len(waited), timeout=0, fetch_local=False)
        return [each for each in self._running if any(each.told is one for one in found)]

    def _take(self, each: _Attempt) -> Ending | None:
        """What has been told since; its ending, if that was told, or it won't be."""
        for _ in range(MOST_TAKEN):
            try:
                if self._ray.wait([each.told], timeout=0, fetch_local=False)[1]:
                    return None
                told = self._ray.get(next(each.told))
            except StopIteration:
                return Ending(lost="its node told nothing more")
            except self._ray.exceptions.RayError as error:
                return Ending(lost=in_a_line(error), span=(each.began, time.time()))
            if isinstance(told, Ending):
                self._is_packed |= "doesn't see" in told.lost
                return told
            self._take_in(each, told)
        return None

    def _take_in(self, each: _Attempt, told: Any) -> None:
        if isinstance(told, Began):
            node = self._cluster.nodes.get(told.node)
            each.node = node.name if node else told.node
            return
        try:
            each.inbox.take(told)
        except OSError as error:
            raise WorkbenchError(f"can't write {error.filename}: {error.strerror}") from error

    def stop(self, job: Job) -> None:
        """See Machines."""
        for each in self._running:
            if each.job == job:
                self._ray.cancel(each.told)

    def close(self) -> None:
        """See Machines."""
        for each in self._running:
            self._ray.cancel(each.told, force=True)
            each.held.close()
        self._running.clear()
        (self._home.folder / TOKEN).unlink(missing_ok=True)

    def _those_that_do_not_see(self) -> list[str]:
        """The names of nodes that don't see the folder of the jobs; warns of locks that aren't told."""
        nodes = list(self._cluster.nodes.values())
        look = self._ray.remote(num_cpus=0)(_look)
        asked = [look.options(label_selector=only(node.id)).remote(self._home) for node in nodes]
        return [
            node.name
            for node, answer in zip(nodes, asked, strict=True)
            if not self._sees(node, answer)
        ]

    def _sees(self, node: Node, answer: Any) -> bool:
        try:
            is_seen, is_told = self._ray.get(answer, timeout=PATIENCE)
        except self._ray.exceptions.RayError:
            return False
        if is_seen and not is_told:
            warn(
                f"the file system of {self._home.folder} doesn't tell {node.name} of locks: nothing keeps "
                "a second benchmark there out"
            )
        return bool(is_seen)


def _look(home: Home) -> tuple[bool, bool]:
    is_seen = sees(home)
    return is_seen, is_seen and run_folder.is_held(home.folder)
