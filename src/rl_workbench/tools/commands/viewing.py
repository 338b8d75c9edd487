"""view: a run on a page in the browser."""

import argparse
import os
import sys
import threading
from pathlib import Path

import torch

from rl_workbench.env_ids import import_module_of
from rl_workbench.starting import Interrupt
from rl_workbench.tools.commands.shared import add_environment_flags, env_options
from rl_workbench.tools.pictures.filming import draw_without_display
from rl_workbench.tools.runs.runs import open_run
from rl_workbench.tools.viewing.page import Place, Wanted, show_run
from rl_workbench.tools.viewing.recorder import POLICIES
from viewer.address import add_flags as add_page_flags

KINDNESS = 10  # of a page beside a training: whatever it does, the training goes first


def add_flags(parser: argparse.ArgumentParser, command: str) -> None:
    """Its flags."""
    add = parser.add_argument
    add("run", type=Path, metavar="RUN", help="a run folder, also of a training that runs")
    add("--checkpoint", choices=POLICIES, nargs="+", default=list(POLICIES),
        help="policies to choose from, the first one is played first: by evaluation, the newest, random "
        "actions (default all)")  # fmt: skip
    add_environment_flags(parser)
    add_page_flags(parser)
    add("--beside-training", action="store_true", help=argparse.SUPPRESS)


def run(arguments: argparse.Namespace, interrupt: Interrupt) -> None:
    """Shows it until Ctrl-C, or until the training ends beside which it was started.

    Raises:
        WorkbenchError: if there is no such run, or the page can't be served.
    """
    beside: bool = arguments.beside_training
    if beside:
        os.nice(KINDNESS)
    wanted = Wanted(
        arguments.run, tuple(arguments.checkpoint), arguments.seed, 1, env_options(arguments)
    )
    place = Place(arguments.host, arguments.port, not arguments.no_browser)
    show(wanted, place, interrupt, beside)


def show(wanted: Wanted, place: Place, interrupt: Interrupt, beside: bool = False) -> None:
    """Shows a run's page until Ctrl-C.

    Args:
        beside: a training has started this; it is told the address, and its end is this one's.

    Raises:
        WorkbenchError: if there is no such run or no module of its environment, or the page can't be served.
    """
    run = None if beside else open_run(wanted.folder)
    draw_without_display()
    if run is not None:
        import_module_of(run.env_id)
    torch.set_num_threads(1)  # networks this small only lose by more
    interrupt.defer()
    if not beside:
        show_run(wanted, place, interrupt.requested)
        return
    ended = threading.Event()
    threading.Thread(target=_await_end, args=(ended,), daemon=True).start()
    show_run(wanted, place, lambda: ended.is_set() or interrupt.requested(), _nothing_more_to_tell)


def _await_end(ended: threading.Event) -> None:
    """The training keeps the other end of standard input open; however it ends, that is closed."""
    sys.stdin.buffer.read()
    ended.set()


def _nothing_more_to_tell() -> None:
    """Closes standard output, as the training that reads it waits for."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, sys.stdout.fileno())
    os.close(nowhere)
