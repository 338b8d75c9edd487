"""`train`: one command line for every algorithm; errors in one line, exit codes."""

import argparse
import sys
from collections.abc import Callable
from contextlib import AbstractContextManager, ExitStack, nullcontext
from importlib import import_module
from pathlib import Path
from typing import Any, NoReturn

from rl_workbench import starting
from rl_workbench.errors import WorkbenchError
from rl_workbench.output import reader_may_go
from rl_workbench.training.algorithms import ALGORITHMS, algorithm, recorded_kind
from rl_workbench.training.options.command_line import USAGE, check_flag
from rl_workbench.training.options.kind import AlgorithmKind
from rl_workbench.training.options.training_options import TrainingOptions, choose
from rl_workbench.training.page import page_beside
from rl_workbench.training.run import folder as run_folder
from rl_workbench.training.run.interrupt import Interrupt
from rl_workbench.training.run.progress import tell

PROG = "rl-workbench train"
PROGRAM = starting.program("rl_workbench")
EPILOG = """\
dqn and the two of REINFORCE are our own, the others Stable-Baselines3's.
Each has flags of its own: --algo NAME --help shows them."""


def choose_training(
    argv: list[str],
    parameters: dict[str, Any] | None = None,
    prog: str = PROG,
    default: str | None = None,
    env_id: str | None = None,
    parent: argparse.ArgumentParser | None = None,
) -> TrainingOptions:
    """What the arguments say, --algo first, since the other flags depend on it.

    Args:
        parameters: ROS parameters of the node that trains, if it is one.
        prog: the command, for --help.
        default: the algorithm if none is named.
        env_id: the environment if none is named.
        parent: has further flags, which were read already; --help shows them.

    Raises:
        SystemExit: with code 2 and a usage line, if they are wrong; with 0 after --help.
        WorkbenchError: if a name is unknown or a value wrong.
    """
    parser, parameters = _parser(prog), dict(parameters or {})
    known, rest = parser.parse_known_args(argv)
    named = getattr(known, "algo", None) or parameters.pop("algo", None) or None
    resumed = _resume_flag().parse_known_args(rest)[0].resume or parameters.get("resume")
    parents = [parser, *([parent] if parent else [])]
    if named is None and resumed:
        return choose(recorded_kind(Path(resumed)), rest, parameters, prog, env_id, parents)
    if named is None and default is None:
        _without_algorithm(parser, rest)
    try:
        kind: AlgorithmKind = algorithm(named or str(default))
    except WorkbenchError as error:
        parser.error(str(error))
    return choose(kind, rest, parameters, prog, env_id, parents)


def _parser(prog: str) -> argparse.ArgumentParser:
    result = argparse.ArgumentParser(
        prog,
        usage=USAGE.format(prog=prog),
        description="Trains an agent.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
        add_help=False,  # --algo NAME --help is the algorithm's
        argument_default=argparse.SUPPRESS,
    )
    names = ", ".join(ALGORITHMS)
    result.add_argument("--algo", metavar="NAME", help=f"one of {names}; each has flags of its own")
    return result


def _resume_flag() -> argparse.ArgumentParser:
    """Finds the training that goes on, whose algorithm needn't be named."""
    result = argparse.ArgumentParser(add_help=False, allow_abbrev=False)
    result.add_argument("--resume", nargs="?")
    return result


def _without_algorithm(parser: argparse.ArgumentParser, rest: list[str]) -> NoReturn:
    if "-h" in rest or "--help" in rest:
        parser.print_help()
        parser.exit()
    for given in rest:
        check_flag(parser, given.partition("=")[0])
    parser.error(f"--algo is missing, one of {', '.join(ALGORITHMS)}")


def train(
    options: TrainingOptions, interrupt: Interrupt, begin: Callable[[Path], object] = lambda _: None
) -> Path:
    """Trains into the options' folder, or a new one below runs/; returns it.

    Args:
        begin: is called with the folder before anything is trained, to start what goes beside.

    Raises:
        WorkbenchError: if something fails that the user can mend; what was learned is saved.
    """
    with interrupt.reading():  # both are slow to import; --help needs none
        from rl_workbench.training.run.training import Training

        import_module(options.kind.implementation)

    run = options.run
    try:
        with ExitStack() as holding:
            if options.resume:
                folder = options.resume.resolve()
                holding.enter_context(run_folder.held(folder))
            else:
                place = (run.run_dir, run.env_id, run.exp_name, run.seed)
                folder = holding.enter_context(run_folder.opened(*place))
            begin(folder)
            training = Training(options, folder, interrupt)
            interrupt.defer()
            training.run()
    finally:
        interrupt.defer()
    return folder


@reader_may_go()
def main(
    argv: list[str] | None = None,
    parameters: dict[str, Any] | None = None,
    prog: str = PROG,
    default: str | None = None,
    program: tuple[str, ...] = PROGRAM,
) -> int:
    """Trains as the arguments say; returns the process's exit code.

    Args:
        parameters: ROS parameters of the node that trains, if it is one.
        prog: the command's name, for --help and errors.
        default: the algorithm if none is named.
        program: how the whole command line is started, for a page in a process of its own.
    """
    interrupt = Interrupt().install()
    try:
        options = _chosen(sys.argv[1:] if argv is None else argv, parameters, prog, default)
        with ExitStack() as beside:
            train(
                options,
                interrupt,
                lambda folder: beside.enter_context(shown(options, folder, program)),
            )
        return interrupt.exit_code
    except WorkbenchError as error:
        print(f"{prog}: {error}", file=sys.stderr, flush=True)
        return interrupt.exit_code or 1
    except KeyboardInterrupt:
        print(f"{prog}: interrupted before the training began", file=sys.stderr)
        return interrupt.exit_code or 130
    finally:
        interrupt.defer()  # Python is ending


def shown(
    options: TrainingOptions, folder: Path, program: tuple[str, ...]
) -> AbstractContextManager[None]:
    """The training's page for as long as it is entered, if it is asked for."""
    return page_beside(folder, program, tell) if options.session.gui else nullcontext()


def _chosen(
    argv: list[str], parameters: dict[str, Any] | None, prog: str, default: str | None
) -> TrainingOptions:
    """What the arguments say; whatever is wrong with them is exit code 2."""
    try:
        return choose_training(argv, parameters, prog, default)
    except WorkbenchError as error:
        _parser(prog).error(str(error))
