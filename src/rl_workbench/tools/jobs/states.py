"""How jobs are getting on, from files alone: also those that another machine or an earlier command ran."""

import json
import socket
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from files.content import open_text
from rl_workbench.errors import WorkbenchError
from rl_workbench.storage import CONFIG_RECORD
from rl_workbench.tools.jobs.job import last_words, log_of
from rl_workbench.tools.jobs.ledger import ALIVE, DONE, FAILED, NAME, RUNNING, WAITING, Entry
from rl_workbench.tools.runs.runs import SUMMARY, read_leniently
from rl_workbench.training import folder as run_folder
from rl_workbench.training.scalar_log import NAME as SCALARS

STOPPED = "stopped"  # half done, and nobody runs it now
TAIL = 4096  # [bytes] of a table that hold its last row


@dataclass(frozen=True)
class JobState:
    """One job."""

    name: str
    folder: str
    state: str  # done, running, failed, waiting or stopped
    step: int  # of the environment, that it has come to
    steps: int  # of the whole training; 0: its length isn't counted in steps
    node: str  # the last one that it ran on
    attempts: int
    seconds: float  # since the attempt began that runs; else 0
    line: str  # why it failed; else the last thing that it said


def read_states(folder: Path) -> list[JobState]:
    """The jobs of a benchmark's or a search's folder.

    Raises:
        WorkbenchError: if it has none.
    """
    entries, is_alive = _read(folder)
    return [_state(folder, entry, is_alive) for entry in entries]


def steps_of(folder: Path) -> tuple[int, int]:
    """The step that a run has come to, and those of the whole training; 0 for what isn't known."""
    run = read_leniently(folder / CONFIG_RECORD).get("run")
    length = run.get("total_timesteps") if isinstance(run, dict) else 0
    return next(_steps(folder / SCALARS), 0), length if isinstance(length, int) else 0


def _steps(path: Path) -> Iterator[int]:
    """Of the last whole rows of a table, the last one first."""
    try:
        with path.open("rb") as file:
            file.seek(max(0, file.seek(0, 2) - TAIL))
            rows = file.read().split(b"\n")[:-1]
    except OSError:
        return
    for row in reversed(rows):
        step, tag, *_ = *row.split(b","), b""
        if step.isdigit() and b"/" in tag:  # without, it is a curve over episodes
            yield int(step)


def _read(folder: Path) -> tuple[list[Entry], bool]:
    """The ledger, and whether somebody runs its jobs now."""
    path = folder / NAME
    try:
        with open_text(path) as file:
            content = json.load(file)
        entries = [Entry(**each) for each in content["jobs"]]
        age = time.time() - path.stat().st_mtime
        is_elsewhere = content["host"] != socket.gethostname()
    except OSError as error:
        raise WorkbenchError(
            f"{folder} has no jobs: {NAME} lies in the folder of a benchmark or a sweep "
            f"({error.strerror})"
        ) from error
    except (ValueError, TypeError, KeyError) as error:
        raise WorkbenchError(f"{path} isn't a list of jobs: {error}") from error
    # Not every file system tells other machines of locks.
    return entries, run_folder.is_held(folder) or (is_elsewhere and age < 2 * ALIVE)


def _state(folder: Path, entry: Entry, is_alive: bool) -> JobState:
    run = folder / entry.folder
    summary = read_leniently(run / SUMMARY)
    (step, steps), state, line = steps_of(run), entry.state, last_words(log_of(run))
    if summary.get("complete"):
        step, state, line = summary["steps"], DONE, _outcome(summary)
    elif state == FAILED:
        line = entry.note
    elif state == DONE:
        line = "ended early: the rest wasn't needed any more"
    elif state == RUNNING and not is_alive or state == WAITING and step:
        state = STOPPED if not is_alive else WAITING
    if state == STOPPED and summary.get("interrupted"):
        line = _outcome(summary)
    elif state == WAITING and entry.note:
        line = f"lost, and tried again: {entry.note}"
    since = max(time.time() - entry.began, 0.0) if state == RUNNING and entry.began else 0.0
    return JobState(
        entry.name, entry.folder, state, step, steps, entry.node, entry.attempts, round(since, 1), line
    )  # fmt: skip


def told(summary: dict[str, Any]) -> str:
    """What a run came to, in a line."""
    return f"{summary['steps']} steps {_outcome(summary)}"


def _outcome(summary: dict[str, Any]) -> str:
    best = summary.get("best")
    found = f"best evaluation {best[1]:.1f} at step {best[0]}" if best else "no evaluation"
    return f"in {summary['seconds']:.1f} s, {found}"
