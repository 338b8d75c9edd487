"""The command `train`, and the same from Python."""

import sys
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, ExitStack, nullcontext
from importlib import import_module
from pathlib import Path
from typing import Any

from rl_workbench import starting
from rl_workbench.errors import WorkbenchError
from rl_workbench.starting import Interrupt, reader_may_go
from rl_workbench.training.algorithms import algorithm
from rl_workbench.training.callbacks import Callback, load_callbacks
from rl_workbench.training.command_line import PROG, algorithm_parser, choose, choose_training
from rl_workbench.training.options import TrainingOptions

PROGRAM = starting.program("rl_workbench")


def train(algo: str, callbacks: Sequence[Callback] = (), **options: Any) -> Path:
    """Trains an agent from Python, like `rl-workbench train`.

        folder = train("dqn", env_id="CartPole-v1", total_timesteps=5000, callbacks=[Mine()])

    Args:
        algo: The algorithm, as `--algo` names it.
        callbacks: Called at the events of the training, see `Callback`.
        options: Options by name, as the flags with underscores; also `config`, `preset` and `resume`.

    Returns:
        The run folder.

    Raises:
        WorkbenchError: If an option is wrong, or the training fails. What was learned is saved.
    """
    return run_training(choose(algorithm(algo), [], options), Interrupt(), callbacks=callbacks)


def run_training(
    options: TrainingOptions,
    interrupt: Interrupt,
    begin: Callable[[Path], object] = lambda _: None,
    callbacks: Sequence[Callback] = (),
) -> Path:
    """Trains into the options' folder, or a new one below runs/.

    Args:
        options: Of a new training, or of one to resume.
        interrupt: Says when to stop.
        begin: Is called with the folder before the training begins, to start what goes beside it.
        callbacks: Further ones than those that the options name.

    Returns:
        The folder.

    Raises:
        WorkbenchError: If something fails that the user can mend. What was learned is saved.
    """
    with interrupt.reading():  # both are slow to import, and --help needs neither
        from rl_workbench.training import folder as run_folder
        from rl_workbench.training.training import Training

        import_module(options.kind.implementation)

    callbacks = [*callbacks, *load_callbacks(options.session.callback)]
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
            training = Training(options, folder, interrupt, callbacks)
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
    program: Sequence[str] = PROGRAM,
) -> int:
    """Trains as the arguments say; returns the exit code of the process.

    Args:
        argv: The arguments without the command.
        parameters: Options from outside, as a launch file sets them.
        prog: The command's name, for `--help` and errors.
        default: The algorithm if none is named.
        program: Starts the whole command line, for a page in a process of its own.
    """
    interrupt = Interrupt().install()
    try:
        try:
            options = choose_training(
                sys.argv[1:] if argv is None else argv, parameters, prog, default
            )
        except WorkbenchError as error:  # wrong arguments too, wherever they were written
            algorithm_parser(prog).error(str(error))
        with ExitStack() as beside:

            def begin(folder: Path) -> None:
                beside.enter_context(shown(options, folder, tuple(program)))

            run_training(options, interrupt, begin)
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
    """Shows the training's page while the block lasts, if it was asked for."""
    if not options.session.gui:
        return nullcontext()
    from rl_workbench.training.page import page_beside
    from rl_workbench.training.progress import tell

    return page_beside(folder, program, tell)
