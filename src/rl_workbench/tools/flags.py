"""Flags shared by several commands, and writing of pictures."""

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rl_workbench.errors import WorkbenchError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WHICH = ("best", "last")  # checkpoints: the best by evaluation, the newest
RANDOM = "random"
POLICIES = (*WHICH, RANDOM)


def add_policy_flags(
    parser: argparse.ArgumentParser,
    choices: tuple[str, ...] = WHICH,
    several: bool = False,
    plays: bool = True,
) -> None:
    """Adds the flags that choose a run, one of its policies (or several), and the environment.

    A command that `plays` has a seed.
    """
    parser.add_argument("run", type=Path, metavar="RUN", help="a run folder")
    which = "best by evaluation, newest" + (", or random actions" if RANDOM in choices else "")
    how_many: dict[str, Any] = {"default": "best"}
    if several:
        how_many, which = {"default": ["best"], "nargs": "+"}, f"{which}; several side by side"
    parser.add_argument("--checkpoint", choices=choices, help=f"{which} (default best)", **how_many)
    add_environment_flags(parser, plays)


def add_environment_flags(parser: argparse.ArgumentParser, plays: bool = True) -> None:
    """Adds the seed of the episodes, if the command `plays` any, and the options of the environment."""
    if plays:
        parser.add_argument("--seed", type=number(0), default=0, metavar="N",
                            help="seed of the episodes (default 0)")  # fmt: skip
    parser.add_argument("--env-kwargs", nargs="+", default=[], metavar="KEY=VALUE",
                        help="options of the environment, e.g. max_steps=200")  # fmt: skip


def add_job_flags(parser: argparse.ArgumentParser) -> None:
    """Adds the flags for where trainings run, and how many at a time."""
    parser.add_argument("--jobs", type=number(1), metavar="N",
                        help="trainings at a time, each on one core (default 1; with --ray the "
                        "number of cores)")  # fmt: skip
    parser.add_argument("--ray", metavar="ADDRESS",
                        help="train on a Ray cluster, whose nodes all see --out: HOST:PORT of its "
                        "head, auto for the cluster of this machine, or local to start one here")  # fmt: skip


def env_options(arguments: argparse.Namespace) -> dict[str, Any]:
    """Returns the options of the environment, with values as `train` reads them."""
    return typed_values(arguments.env_kwargs, "--env-kwargs")


def typed_values(words: Sequence[str], flag: str) -> dict[str, Any]:
    """Returns the values of a flag's words KEY=VALUE, as YAML reads them."""
    from rl_workbench.option import mapping

    text = ",".join(words)
    try:
        return mapping(text)
    except ValueError as error:
        raise WorkbenchError(f"{flag} must be {error}, not {text!r}") from error


def number(lowest: int) -> Any:
    """Returns an argparse type: a whole number from `lowest` on."""

    def whole(text: str) -> int:
        value = int(text)
        if not lowest <= value < 2**31:
            raise argparse.ArgumentTypeError(f"must be at least {lowest} and below 2^31: {text}")
        return value

    whole.__name__ = "whole number"  # argparse names it so in its errors
    return whole


def write_figure(path: Path, figure: "Figure") -> None:
    """Writes a picture as PNG."""
    from rl_workbench.plotting import as_png
    from rl_workbench.storage import write_file

    if path.suffix.lower() != ".png":
        raise WorkbenchError(f"pictures are PNG: name one that ends in .png, not {path}")
    write_file(path, as_png(figure))
