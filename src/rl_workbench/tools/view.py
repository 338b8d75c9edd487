"""`view`: shows a run on a page in the browser, also while it trains."""

import argparse
import os
from pathlib import Path

from rl_workbench.starting import Interrupt
from rl_workbench.tools.flags import POLICIES, add_environment_flags, env_options
from web_viewer.address import add_flags as add_page_flags

NICENESS = 10  # of a page that accompanies a training, so that the training has priority


def add_flags(parser: argparse.ArgumentParser) -> None:
    """Adds the flags of the command."""
    add = parser.add_argument
    add("run", type=Path, metavar="RUN", help="a run folder, also of a training that runs")
    add("--checkpoint", choices=POLICIES, nargs="+", default=list(POLICIES),
        help="policies to choose from, the one to start with first: best by evaluation, newest, "
        "random actions (default all)")  # fmt: skip
    add_environment_flags(parser)
    add_page_flags(parser)
    add("--beside-training", action="store_true", help=argparse.SUPPRESS)


def run(arguments: argparse.Namespace, interrupt: Interrupt) -> None:
    """Serves the page until Ctrl-C, or until the training that started it ends."""
    from rl_workbench.tools.run_page import show_run

    if arguments.beside_training:
        os.nice(NICENESS)
    show_run(
        arguments.run, tuple(arguments.checkpoint), arguments.seed, env_options(arguments),
        host=arguments.host, port=arguments.port, browser=not arguments.no_browser,
        interrupt=interrupt, beside_training=arguments.beside_training,
    )  # fmt: skip
