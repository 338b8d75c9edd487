"""`compare`: tables of runs and of groups of seeds, and their curves."""

import argparse
from pathlib import Path

from rl_workbench.starting import Interrupt
from rl_workbench.tools.flags import WHICH, number, write_figure
from rl_workbench.training.progress import tell, warn


def add_flags(parser: argparse.ArgumentParser) -> None:
    """Adds the flags of the command."""
    add = parser.add_argument
    add("runs", nargs="+", metavar="RUN", help="run folders, patterns, or folders that hold runs")
    add("--episodes", type=number(0), default=20, metavar="N",
        help="greedy episodes for each run's score; 0: the mean return of its last 100 training "
        "episodes (default 20)")  # fmt: skip
    add("--checkpoint", choices=WHICH, default="best", help="the policy that plays (default best)")
    add("--out", type=Path, metavar="FILE.png", help="learning curves with their intervals")
    add("--json", type=Path, metavar="FILE", help="all figures")


def run(arguments: argparse.Namespace, interrupt: Interrupt) -> None:
    """Prints two tables, and writes the requested files."""
    from rl_workbench.plotting import seed_curves
    from rl_workbench.storage import as_json, check_writable, write_file
    from rl_workbench.tools import results
    from rl_workbench.tools.plot import seed_panels
    from rl_workbench.tools.runs import find_runs

    for path in filter(None, (arguments.out, arguments.json)):
        check_writable(path)
    runs = find_runs(arguments.runs, warn)
    episodes, which = arguments.episodes, arguments.checkpoint
    every = [  # seeds of one experiment and environment make a group
        results.examine(run, f"{run.experiment} in {run.env_id}", episodes, warn, which) for run in runs
    ]
    every.sort(key=lambda result: (result.group, result.seed, result.run))
    groups = results.grouped(every)
    tell(results.table(every, results.COMPARE) + "\n")
    tell(results.summary_table(groups, results.SUMMARY))
    if arguments.json:
        kind = f"mean of {episodes} greedy episodes, {which} checkpoint"
        score = kind if episodes else "mean of the last 100 training episodes"
        figures = {name: results.figures(own) for name, own in groups.items()}
        write_file(arguments.json, as_json({"score": score, "groups": figures}))
    if arguments.out:
        write_figure(arguments.out, seed_curves(seed_panels(runs)))
