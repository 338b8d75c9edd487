"""plot and policy: pictures of runs."""

import argparse
from pathlib import Path

from rl_workbench.tools.commands.shared import add_policy_flags, env_options
from rl_workbench.tools.pictures.state_plane import plane_of, policy_picture
from rl_workbench.tools.pictures.training_curves import training_curves
from rl_workbench.tools.runs.episodes import TEST_SEED
from rl_workbench.tools.runs.players import load_player
from rl_workbench.tools.runs.runs import find_runs, open_run
from rl_workbench.training.run.interrupt import Interrupt
from rl_workbench.training.run.progress import warn
from rl_workbench.training.run.results import check_writable, write_figure


def add_flags(parser: argparse.ArgumentParser, command: str) -> None:
    """Flags of one of the two."""
    if command == "policy":
        add_policy_flags(parser)
    else:
        parser.add_argument("runs", nargs="+", metavar="RUN", help="run folders, or patterns")
        parser.add_argument("--over", choices=("episodes", "steps"), default="episodes",
                            help="the horizontal axis (default episodes)")  # fmt: skip
    parser.add_argument("--out", type=Path, required=True, metavar="FILE.png", help="the picture")


def run(arguments: argparse.Namespace, interrupt: Interrupt) -> None:
    """One of the two.

    Raises:
        WorkbenchError: if something is wrong with a run or the file.
    """
    if arguments.command == "plot":
        runs = find_runs(arguments.runs, warn)
        write_figure(arguments.out, training_curves(runs, arguments.over))
    else:
        _policy(arguments)
    print(arguments.out)


def _policy(arguments: argparse.Namespace) -> None:
    run = open_run(arguments.run)
    plane_of(run)  # other environments are refused before anything is loaded
    check_writable(arguments.out)
    player = load_player(run, arguments.checkpoint, env_options(arguments))
    try:
        figure = policy_picture(run, player, TEST_SEED + arguments.seed)
    finally:
        player.env.close()
    write_figure(arguments.out, figure)
