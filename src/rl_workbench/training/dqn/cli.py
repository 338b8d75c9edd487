"""The command dqn_train.py: errors in one line, exit codes."""

import sys
from typing import Any

from cartpole.envs import ros_node
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
        flags = ros_node.plain_arguments(argv)
        own = ros_node.command_line_parameters(argv)
        choose(flags, own)  # wrong flags and --help need no master
        return run(choose(flags, _parameters(argv) | own), interrupt)
    except WorkbenchError as error:
        print(f"{NODE}: {error}", file=sys.stderr, flush=True)
        return interrupt.exit_code or 1
    except KeyboardInterrupt:
        print(f"{NODE}: interrupted before the training began", file=sys.stderr)
        return interrupt.exit_code or 130


def _parameters(argv: list[str]) -> dict[str, Any]:
    """Private rosparams; only roslaunch's nodes need a master for them."""
    try:
        return ros_node.private_parameters(ros_node.full_name(argv, NODE))
    except WorkbenchError:
        if any(argument.startswith("__name:=") for argument in argv):
            raise
        return {}


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
