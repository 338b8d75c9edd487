"""plot and policy: pictures of runs."""

import argparse
from pathlib import Path

from cartpole.training.interrupt import Interrupt
from cartpole.workbench.commands.shared import add_policy_flags, env_options
from cartpole.workbench.episodes import TEST_SEED
from cartpole.workbench.files import check_writable, write_figure
from cartpole.workbench.pictures import training_curves
from cartpole.workbench.players import load_player, warn
from cartpole.workbench.runs import find_runs, open_run
from cartpole.workbench.state_plane import plane_of, policy_picture


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
        CartpoleError: if something is wrong with a run or the file.
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
