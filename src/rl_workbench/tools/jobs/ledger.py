"""FOLDER/jobs.json: which jobs there are and how each is getting on, for who looks from outside."""

import os
import socket
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from rl_workbench.storage import as_json, write_file
from rl_workbench.tools.jobs.job import Job
from rl_workbench.tools.jobs.runner import Watch
from rl_workbench.tools.runs.runs import read_leniently

NAME = "jobs.json"
WAITING, RUNNING, DONE, FAILED = "waiting", "running", "done", "failed"
WRITTEN_AFTER = 0.5  # [s] at most until a change can be read
ALIVE = 20.0  # [s] at most between two writings, as long as somebody runs the jobs


def settle(folder: Path) -> None:
    """Nothing runs yet, whatever a command that was killed has left written."""
    content = read_leniently(folder / NAME)
    running = [each for each in content.get("jobs", []) if each.get("state") == RUNNING]
    for each in running:
        each["state"] = WAITING
    if running:
        write_file(folder / NAME, as_json(content))


@dataclass
class Entry:
    """One job, as far as its own files don't tell it."""

    name: str
    folder: str  # of the run, relative to that of the ledger
    state: str = WAITING
    node: str = ""  # the last one that it ran on
    attempts: int = 0
    note: str = ""  # why it failed, or was lost
    began: float = 0.0  # the last attempt [s since 1970]


class Ledger(Watch):
    """Writes it.

    Args:
        folder: of the ledger; the jobs' own lie in it.
        jobs: those that are known from the beginning; none: they come up as others end, and those of
            earlier calls stay.

    Raises:
        WorkbenchError: if the disk refuses, as each method does.
    """

    def __init__(self, folder: Path, jobs: Sequence[Job] = ()) -> None:
        self._folder = folder
        self._earlier = {} if jobs else _written_before(folder)
        self._entries: dict[Job, Entry] = {}
        for job in jobs:
            self._entry(job)
        self._written, self._is_changed = 0.0, True
        self._write()

    def skipped(self, job: Job) -> None:
        """See Watch."""
        self._change(job, DONE, "")

    def began(self, job: Job, node: str) -> None:
        """See Watch."""
        entry = self._entry(job)
        entry.state, entry.node, entry.attempts = RUNNING, node, entry.attempts + 1
        entry.began = round(time.time(), 1)
        self._is_changed = True

    def progressed(self, job: Job, node: str) -> None:
        """See Watch."""
        entry = self._entry(job)
        if entry.node != node:
            entry.node, self._is_changed = node, True
        since = time.monotonic() - self._written
        if since > (WRITTEN_AFTER if self._is_changed else ALIVE):
            self._write()

    def lost(self, job: Job, reason: str) -> None:
        """See Watch."""
        self._change(job, WAITING, reason)

    def ended(self, job: Job, failure: str) -> None:
        """See Watch."""
        self._change(job, FAILED if failure else DONE, failure)

    def close(self) -> None:
        """Nothing runs any more."""
        for entry in self._entries.values():
            if entry.state == RUNNING:
                entry.state = WAITING
        self._write()

    def counts(self) -> dict[str, int]:
        """How many jobs are in each state."""
        states = [entry.state for entry in self._entries.values()]
        return {state: states.count(state) for state in (DONE, RUNNING, FAILED, WAITING)}

    def _entry(self, job: Job) -> Entry:
        if job not in self._entries:
            place = os.path.relpath(job.folder, self._folder)
            state = DONE if job.is_done() else WAITING
            before = self._earlier.pop(place, Entry(job.name, place))
            self._entries[job] = replace(before, state=state)
        return self._entries[job]

    def _change(self, job: Job, state: str, note: str) -> None:
        entry = self._entry(job)
        entry.state, entry.note = state, note
        self._is_changed = True

    def _write(self) -> None:
        content = {
            "host": socket.gethostname(),
            "jobs": [asdict(entry) for entry in (*self._earlier.values(), *self._entries.values())],
        }
        write_file(self._folder / NAME, as_json(content))
        self._written, self._is_changed = time.monotonic(), False


def _written_before(folder: Path) -> dict[str, Entry]:
    """The entries by their folders; none if there are none, or they can't be read."""
    found = read_leniently(folder / NAME).get("jobs")
    try:
        entries = [Entry(**each) for each in found] if isinstance(found, list) else []
    except TypeError:
        return {}
    return {entry.folder: entry for entry in entries}
