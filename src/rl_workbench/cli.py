"""The command line: its subcommands, errors in one line, exit codes."""

import argparse
import sys
from importlib import import_module
from typing import Any, NamedTuple

from rl_workbench.errors import WorkbenchError
from rl_workbench.option import unknown
from rl_workbench.starting import Interrupt, reader_may_go
from rl_workbench.training import train as training

PROG = "rl-workbench"
DESCRIPTION = """\
Trains agents in Gymnasium's environments, and looks at what they learned.

RUN is a run folder, as runs/CartPole-v1__dqn__0__1700000000. No ROS master is needed.
Exit codes: 0 done, 1 failed, 2 wrong arguments; 130 after Ctrl-C."""


class _Command(NamedTuple):
    """A subcommand: the module with its add_flags and run, and a line of help."""

    module: str
    help: str


TRAIN = "train"
COMMANDS = {
    "eval": _Command("watching", "greedy episodes of a run: mean, deviation, every episode"),
    "enjoy": _Command("watching", "watch greedy episodes in a window"),
    "view": _Command(
        "viewing", "a page in the browser: curves, and episodes, also while it trains"
    ),
    "record": _Command(
        "watching", "episodes as GIF, MP4 or a page that plays them, without a display"
    ),
    "plot": _Command("drawing", "the training curves of runs as PNG"),
    "export": _Command(
        "exporting", "a policy as TorchScript, which torch runs without this package"
    ),
    "policy": _Command("drawing", "the policy over the pole's angle and velocity as PNG"),
    "compare": _Command("comparing", "groups of runs: table per seed, IQM, intervals, curves"),
    TRAIN: _Command("", "train by DQN, REINFORCE or Stable-Baselines3"),
    "sweep": _Command("searching", "search options with Optuna"),
    "benchmark": _Command(
        "benchmarking", "train several seeds, or a suite; table per seed, curves"
    ),
    "jobs": _Command("listing", "how the trainings of a benchmark or a sweep are getting on"),
}
PACKAGE = "rl_workbench.tools.commands"


@reader_may_go()
def main(
    argv: list[str] | None = None, prog: str = PROG, program: tuple[str, ...] = training.PROGRAM
) -> int:
    """Does what the arguments say; returns the process's exit code.

    Args:
        prog: the command's name, for --help and errors.
        program: how it is started, for trainings in processes of their own.
    """
    argv = sys.argv[1:] if argv is None else argv
    if argv[:1] == [TRAIN]:  # its flags depend on the algorithm
        return training.main(argv[1:], prog=f"{prog} {TRAIN}", program=program)
    interrupt = Interrupt().install()
    try:
        with interrupt.reading():
            arguments = parse(argv, prog)
            command = _module(arguments.command)
        arguments.program = program
        command.run(arguments, interrupt)
        return interrupt.exit_code
    except WorkbenchError as error:
        print(f"{prog}: {error}", file=sys.stderr, flush=True)
        return interrupt.exit_code or 1
    except KeyboardInterrupt:
        print(f"{prog}: interrupted", file=sys.stderr)
        return interrupt.exit_code or 130
    finally:
        interrupt.defer()  # Python is ending


def parse(argv: list[str], prog: str = PROG) -> argparse.Namespace:
    """The arguments of the subcommand.

    Raises:
        SystemExit: with code 2 and a usage line, if they are wrong; with 0 after --help.
    """
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
    for name, command in COMMANDS.items():
        own = commands.add_parser(
            name, help=command.help, description=command.help, allow_abbrev=False
        )
        if name == named != TRAIN:  # the others needn't be read
            _module(name).add_flags(own, name)
    return parser.parse_args(argv)


def _module(command: str) -> Any:
    return import_module(f"{PACKAGE}.{COMMANDS[command].module}")
