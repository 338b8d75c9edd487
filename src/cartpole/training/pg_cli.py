"""The command pg_train.py: errors in one line, exit codes."""

import contextlib
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from cartpole.envs import ros_node
from cartpole.errors import CartpoleError
from cartpole.training import run_folder
from cartpole.training.interrupt import Interrupt
from cartpole.training.pg_settings import Settings, settings

if TYPE_CHECKING:
    from cartpole.envs.local_session import LocalSession
    from cartpole.envs.ros_session import RosSession

NODE = "pg_train"


def main(argv: list[str] | None = None) -> int:
    """Trains as the arguments say; returns the process's exit code."""
    argv = sys.argv[1:] if argv is None else argv
    interrupt = Interrupt().install()
    try:
        flags = ros_node.plain_arguments(argv)
        chosen = settings(flags, {})  # wrong flags and --help need no master
        name = ros_node.full_name(argv, NODE)
        if chosen.backend == "ros":  # without ROS there may be no master to ask
            chosen = settings(flags, ros_node.private_parameters(name))
        return run(chosen, name, argv, interrupt)
    except CartpoleError as error:
        return _failed(error, interrupt)
    except KeyboardInterrupt:
        print(f"{NODE}: interrupted before the training began", file=sys.stderr)
        return interrupt.exit_code or 130


def run(chosen: Settings, name: str, argv: list[str], interrupt: Interrupt) -> int:
    """Brings up what is needed, trains, and ends what it brought up.

    Args:
        name: this node's full name.
        argv: the process's arguments, with roslaunch's remappings.

    Returns:
        The exit code. A failure that the user can mend is one line; what was learned is saved.

    Raises:
        CartpoleError: if the run folder can't be made.
    """
    # Slow to import, and --help needs none of it.
    from cartpole.training.pg_run import Training, say

    folder = run_folder.create(chosen.run_dir, "cartpole", "pg", chosen.seed)
    session = _session(chosen, name, argv)
    try:
        plant = session.start(say)
        interrupt.defer()
        Training(chosen, folder, plant, interrupt).run()
    except CartpoleError as error:
        return _failed(error, interrupt)  # told before the closing: a hung simulator takes its time
    finally:
        interrupt.defer()
        session.close()
        _remove_if_empty(folder)
    return interrupt.exit_code


def _session(chosen: Settings, name: str, argv: list[str]) -> "RosSession | LocalSession":
    if chosen.backend == "bullet":
        from cartpole.envs.local_session import LocalSession

        return LocalSession()
    from cartpole.envs.ros_session import RosSession

    return RosSession(name, argv, chosen.realtime, chosen.gui, chosen.seed)


def _failed(error: CartpoleError, interrupt: Interrupt) -> int:
    print(f"{NODE}: {error}", file=sys.stderr, flush=True)
    return interrupt.exit_code or 1


def _remove_if_empty(folder: Path) -> None:
    with contextlib.suppress(OSError):
        folder.rmdir()
