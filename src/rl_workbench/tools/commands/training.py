"""train: one command line for every algorithm, ours and Stable-Baselines3's.

Each algorithm has flags of its own, so the arguments behind `train` are read by who trains.
"""

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import NoReturn

from rl_workbench.extras import need
from rl_workbench.tools.algorithms import ALGORITHMS, DQN
from rl_workbench.tools.runs.runs import POLICY_GRADIENT, open_run
from rl_workbench.training.dqn import cli as dqn_cli
from rl_workbench.training.options.options import unknown
from rl_workbench.training.run.interrupt import Interrupt
from rl_workbench.training.sb3 import settings as sb3_settings

COMMAND = sb3_settings.COMMAND
EPILOG = """\
dqn (as dqn_train.py) and pg (as pg_train.py) are our own, the others Stable-Baselines3's.
Each has flags of its own: train --algo NAME --help shows them."""


def train(argv: list[str], interrupt: Interrupt) -> int:
    """Trains as the arguments behind `train` say; returns the exit code.

    Raises:
        SystemExit: with code 2 and a usage line, if they are wrong; with 0 after --help.
        WorkbenchError: if something fails that the user can mend; what was learned is saved.
    """
    parser = _parser()
    known, rest = parser.parse_known_args(argv)
    if known.resume:
        rest += ["--resume", known.resume]
    name = known.algo or (open_run(Path(known.resume)).algorithm if known.resume else None)
    if name is None:
        _without_algorithm(parser, rest)
    if name not in ALGORITHMS:
        parser.error(unknown("algorithm", name, list(ALGORITHMS)))
    own = _own(name)
    return own(rest) if own else _with_sb3(name, rest, interrupt)


def _parser() -> argparse.ArgumentParser:
    result = argparse.ArgumentParser(
        COMMAND,
        description="Trains an agent.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
        add_help=False,  # --algo NAME --help is the algorithm's
    )
    result.add_argument("--algo", metavar="NAME", help=f"one of {', '.join(ALGORITHMS)}")
    result.add_argument("--resume", metavar="RUN", help="go on with the training in a run folder")
    return result


def _without_algorithm(parser: argparse.ArgumentParser, rest: list[str]) -> NoReturn:
    if "-h" in rest or "--help" in rest:
        parser.print_help()
        parser.exit()
    parser.error(f"--algo is missing, one of {', '.join(ALGORITHMS)}")


def _own(name: str) -> Callable[[list[str]], int] | None:
    """The command of an algorithm of our own."""
    if name == DQN:
        return dqn_cli.main
    if name == POLICY_GRADIENT:
        from rl_workbench.training.pg import cli as pg_cli

        return pg_cli.main
    return None


def _with_sb3(name: str, flags: list[str], interrupt: Interrupt) -> int:
    need("stable_baselines3", "Stable-Baselines3", "train")
    from rl_workbench.training.sb3 import run as sb3_training

    sb3_training.train(sb3_settings.choose(name, flags), interrupt)
    return interrupt.exit_code
