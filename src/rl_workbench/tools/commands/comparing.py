"""compare: groups of runs against each other."""

import argparse
from dataclasses import asdict
from pathlib import Path

from rl_workbench.tools.benchmark.comparison import (
    Row,
    by_group,
    examine,
    statistics_of,
    summary_table,
    table,
)
from rl_workbench.tools.commands.shared import number
from rl_workbench.tools.pictures.curves import learning_curves
from rl_workbench.tools.runs.players import WHICH
from rl_workbench.tools.runs.runs import find_runs
from rl_workbench.training.run.interrupt import Interrupt
from rl_workbench.training.run.progress import warn
from rl_workbench.training.run.results import check_writable, write_figure, write_json


def add_flags(parser: argparse.ArgumentParser, command: str) -> None:
    """Its flags."""
    add = parser.add_argument
    add("runs", nargs="+", metavar="RUN", help="run folders, patterns, or folders that hold runs")
    add("--episodes", type=number(0), default=20, metavar="N",
        help="greedy episodes for each run's score; 0: the mean return of its last 100 training "
        "episodes (default 20)")  # fmt: skip
    add("--checkpoint", choices=WHICH, default="best", help="that plays them (default best)")
    add("--out", type=Path, metavar="FILE.png", help="learning curves with their intervals")
    add("--json", type=Path, metavar="FILE", help="all figures")


def run(arguments: argparse.Namespace, interrupt: Interrupt) -> None:
    """Prints two tables, and writes what was asked for.

    Raises:
        WorkbenchError: if there is no run, or a file can't be written.
    """
    for path in filter(None, (arguments.out, arguments.json)):
        check_writable(path)
    runs = find_runs(arguments.runs, warn)
    rows = [examine(run, arguments.episodes, arguments.checkpoint, warn) for run in runs]
    groups = by_group(rows)
    ordered = [row for each in groups.values() for row in each]
    print(f"{table(ordered)}\n\n{summary_table(groups)}", flush=True)
    if arguments.json:
        write_json(arguments.json, _content(arguments, groups))
    if arguments.out:
        write_figure(arguments.out, learning_curves(runs))


def _content(arguments: argparse.Namespace, groups: dict[str, list[Row]]) -> dict[str, object]:
    kind = f"mean of {arguments.episodes} greedy episodes, {arguments.checkpoint} checkpoint"
    return {
        "score": kind if arguments.episodes else "mean of the last 100 training episodes",
        "groups": {
            name: {
                "statistics": found._asdict() if (found := statistics_of(rows)) else None,
                "runs": [asdict(row) for row in rows],
            }
            for name, rows in groups.items()
        },
    }
