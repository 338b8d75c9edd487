"""compare: groups of runs against each other."""

import argparse
from pathlib import Path

from rl_workbench.plotting.curves import seed_curves
from rl_workbench.starting import Interrupt
from rl_workbench.storage import as_json, check_writable, write_file
from rl_workbench.tools.benchmark import tables
from rl_workbench.tools.benchmark.results import RunResult, examine
from rl_workbench.tools.commands.shared import number, write_figure
from rl_workbench.tools.pictures.panels import seed_panels
from rl_workbench.tools.runs.policies import WHICH
from rl_workbench.tools.runs.runs import find_runs
from rl_workbench.training.progress import tell, warn


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
    results = [
        # The seeds of one experiment and environment are compared with those of another.
        examine(
            run, f"{run.experiment} in {run.env_id}", arguments.episodes, warn, arguments.checkpoint
        )
        for run in runs
    ]
    results.sort(key=lambda result: (result.group, result.seed, result.run))
    groups = tables.grouped(results)
    tell(tables.table(results, tables.COMPARE) + "\n")
    tell(tables.summary_table(groups, tables.COMPARE_SUMMARY))
    if arguments.json:
        write_file(arguments.json, as_json(_content(arguments, groups)))
    if arguments.out:
        write_figure(arguments.out, seed_curves(seed_panels(runs)))


def _content(
    arguments: argparse.Namespace, groups: dict[str, list[RunResult]]
) -> dict[str, object]:
    kind = f"mean of {arguments.episodes} greedy episodes, {arguments.checkpoint} checkpoint"
    return {
        "score": kind if arguments.episodes else "mean of the last 100 training episodes",
        "groups": {
            name: {
                "statistics": found._asdict() if (found := tables.statistics_of(results)) else None,
                "runs": tables.rows(results, tables.COMPARE),
            }
            for name, results in groups.items()
        },
    }
