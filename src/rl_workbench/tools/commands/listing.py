"""jobs: how the jobs of a benchmark or a sweep are getting on."""

import argparse
import datetime
from collections import Counter
from dataclasses import asdict
from pathlib import Path

from rl_workbench.starting import Interrupt
from rl_workbench.storage import as_json, write_file
from rl_workbench.tools.jobs.states import JobState, read_states
from rl_workbench.training.progress import tell


def add_flags(parser: argparse.ArgumentParser, command: str) -> None:
    """Its flags."""
    parser.add_argument(
        "folder", type=Path, metavar="FOLDER", help="of a benchmark or a sweep, also while it runs"
    )
    parser.add_argument("--json", type=Path, metavar="FILE", help="the same, for programs")


def run(arguments: argparse.Namespace, interrupt: Interrupt) -> None:
    """Lists them, from files alone.

    Raises:
        WorkbenchError: if the folder has none.
    """
    states = read_states(arguments.folder)
    if arguments.json:
        write_file(arguments.json, as_json([asdict(each) for each in states]))
    width = max((len(each.name) for each in states), default=0)
    for each in states:
        tell(_line(each, width))
    counts = Counter(each.state for each in states)
    told = (f"{count} {state}" for state, count in counts.items())
    tell(f"{len(states)} jobs: {', '.join(told)}")


def _line(each: JobState, width: int) -> str:
    steps = f"{each.step} of {each.steps}" if each.steps else str(each.step)
    parts = [f"{each.state:8}", f"{each.name:{width}}", f"{steps:>15} steps"]
    if each.node and each.state == "running":
        parts.append(f"for {datetime.timedelta(seconds=int(each.seconds))} on {each.node}")
    if each.attempts > 1:
        parts.append(f"attempt {each.attempts}")
    return "  ".join([*parts, each.line]).rstrip()
