"""The command dqn_train.py: errors in one line, exit codes."""

import sys

import gymnasium

from cartpole.ros_options import ros_options
from rl_workbench.errors import WorkbenchError
from rl_workbench.training.dqn.settings import Choice, choose
from rl_workbench.training.run import folder as run_folder
from rl_workbench.training.run.interrupt import Interrupt

NODE = "dqn_train"


def main(argv: list[str] | None = None) -> int:
    """Trains as the arguments say; returns the process's exit code."""
    argv = sys.argv[1:] if argv is None else argv
    interrupt = Interrupt().install()
    try:
        flags, parameters, _ = ros_options(argv, NODE)
        return run(choose(flags, parameters), interrupt)
    except (WorkbenchError, gymnasium.error.Error) as error:
        print(f"{NODE}: {error}", file=sys.stderr, flush=True)
        return interrupt.exit_code or 1
    except KeyboardInterrupt:
        print(f"{NODE}: interrupted before the training began", file=sys.stderr)
        return interrupt.exit_code or 130


def run(choice: Choice, interrupt: Interrupt) -> int:
    """Trains, or goes on with a training; returns the exit code.

    Raises:
        WorkbenchError: if something fails that the user can mend; what was learned is saved.
    """
    from rl_workbench.training.dqn.run import DQNTraining  # slow to import; --help needs none of it

    chosen = choice.run
    folder = choice.resume or run_folder.create(
        chosen.run_dir or None, chosen.env_id, chosen.exp_name, chosen.seed
    )
    try:
        with run_folder.held(folder):
            training = DQNTraining(choice, folder.resolve(), interrupt)
            interrupt.defer()
            training.run()
    finally:
        interrupt.defer()
        run_folder.remove_if_empty(folder)
    return interrupt.exit_code
