"""What several subcommands have: flags, and pictures as files."""

import argparse
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from rl_workbench.errors import WorkbenchError
from rl_workbench.option import Options
from rl_workbench.plotting.figure import as_png
from rl_workbench.storage import write_file
from rl_workbench.tools.runs.policies import RANDOM, WHICH
from rl_workbench.training.options import RunOptions


def add_policy_flags(
    parser: argparse.ArgumentParser, choices: tuple[str, ...] = WHICH, several: bool = False
) -> None:
    """Which policy of which run, and where it acts; or which several."""
    parser.add_argument("run", type=Path, metavar="RUN", help="a run folder")
    which = "by evaluation, the newest, or random actions" if RANDOM in choices else ""
    which = which or "by evaluation, or the newest"
    if several:
        parser.add_argument("--checkpoint", choices=choices, nargs="+", default=["best"],
                            help=f"{which}; several: side by side (default best)")  # fmt: skip
    else:
        parser.add_argument("--checkpoint", choices=choices, default="best",
                            help=f"{which} (default best)")  # fmt: skip
    add_environment_flags(parser)


def add_environment_flags(parser: argparse.ArgumentParser) -> None:
    """Which episodes, and of which kind."""
    parser.add_argument("--seed", type=number(0), default=0, metavar="N",
                        help="of the episodes (default 0)")  # fmt: skip
    parser.add_argument("--env-kwargs", nargs="+", default=[], metavar="KEY=VALUE",
                        help="options of the environment, as backend=ros; several with commas")  # fmt: skip


def env_options(arguments: argparse.Namespace) -> dict[str, Any]:
    """The environment's options as values, read as `train` reads them.

    Raises:
        WorkbenchError: if one isn't KEY=VALUE.
    """
    text = ",".join(arguments.env_kwargs)
    return dict(
        Options(RunOptions).read({"env_kwargs": text}, "--env-kwargs").get("env_kwargs", {})
    )


def number(lowest: int) -> Any:
    """An argparse type: a whole number from `lowest` on."""

    def whole(text: str) -> int:
        value = int(text)
        if not lowest <= value < 2**31:
            raise argparse.ArgumentTypeError(f"must be at least {lowest} and below 2^31: {text}")
        return value

    whole.__name__ = "whole number"  # argparse's word for it
    return whole


def write_figure(path: Path, figure: Figure) -> None:
    """Writes a picture as PNG.

    Raises:
        WorkbenchError: if the disk refuses, or the name says another format.
    """
    if path.suffix.lower() != ".png":
        raise WorkbenchError(f"pictures are PNG: name one that ends in .png, not {path}")
    write_file(path, as_png(figure))
