"""The command line: its subcommands, errors in one line, exit codes."""

import argparse
import sys
from importlib import import_module
from typing import Any

from rl_workbench.option import unknown
from rl_workbench.starting import Interrupt, run_command
from rl_workbench.training import train as training
from web_viewer.address import PortInUse

PROG = "rl-workbench"
DESCRIPTION = """\
Trains agents in Gymnasium's environments and shows their policies.

RUN is a run folder, as runs/CartPole-v1__dqn__0__1700000000.
Exit codes: 0 done, 1 failed, 2 wrong arguments; 130 after Ctrl-C."""


TRAIN = "train"
# Name: line of help. The module rl_workbench.tools.NAME has add_flags and run.
COMMANDS = {
    "eval": "greedy episodes of a run: mean, deviation, every episode",
    "enjoy": "watch greedy episodes in the environment's window",
    "view": "a page in the browser that plays episodes, also while it trains",
    "record": "episodes as GIF or MP4; needs no display",
    "plot": "the training curves of runs as PNG",
    "export": "a policy as TorchScript, which torch runs without this package",
    "demonstrate": "episodes of a policy as demonstrations: seeds and actions, some kilobytes each",
    "dataset": "replays demonstrations, and writes what was observed, with pictures and sensors",
    "compare": "groups of runs: table per seed, IQM, intervals, curves",
    TRAIN: "train with DQN, REINFORCE or Stable-Baselines3",
    "sweep": "search options with Optuna",
    "benchmark": "train several seeds, or a suite; table per seed, curves",
}


def main(argv: list[str] | None = None, prog: str = PROG, program: tuple[str, ...] = training.PROGRAM) -> int:
    """Runs the command line; returns the exit code. `program` starts it, for trainings as processes."""
    words = sys.argv[1:] if argv is None else argv
    if words[:1] == [TRAIN]:  # its flags depend on the algorithm
        return training.main(words[1:], prog=f"{prog} {TRAIN}", program=program)

    def command(interrupt: Interrupt) -> None:
        with interrupt.reading():
            arguments = parse(words, prog)
            module = _module(arguments.command)
        arguments.program = program
        module.run(arguments, interrupt)

    return run_command(prog, command, PortInUse)


def parse(argv: list[str], prog: str = PROG) -> argparse.Namespace:
    """Parses the arguments of a subcommand; exits with 2 and a usage line if they are wrong."""
    parser = argparse.ArgumentParser(
        prog,
        description=DESCRIPTION,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    named = next((each for each in argv if not each.startswith("-")), None)
    if named is not None and named not in COMMANDS:
        parser.error(unknown("command", named, list(COMMANDS)))
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for name, text in COMMANDS.items():
        own = commands.add_parser(name, help=text, description=text, allow_abbrev=False)
        if name == named != TRAIN:  # the others needn't be imported
            _module(name).add_flags(own)
    return parser.parse_args(argv)


def _module(command: str) -> Any:
    return import_module(f"rl_workbench.tools.{command}")
