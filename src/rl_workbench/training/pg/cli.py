"""The command pg_train.py: errors in one line, exit codes."""

import contextlib
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import gymnasium

from cartpole.robot import CONTROL_PERIOD, ROBOT
from cartpole.ros_options import ros_options
from rl_workbench.errors import WorkbenchError
from rl_workbench.training.pg.settings import Choice, Settings, choose
from rl_workbench.training.run import folder as run_folder
from rl_workbench.training.run.interrupt import Interrupt

if TYPE_CHECKING:
    from rl_workbench.training.pg.stage import Stage

NODE = "pg_train"


def main(argv: list[str] | None = None) -> int:
    """Trains as the arguments say; returns the process's exit code."""
    argv = sys.argv[1:] if argv is None else argv
    interrupt = Interrupt().install()
    try:
        flags, parameters, name = ros_options(argv, NODE)
        return run(choose(flags, parameters), name, argv, interrupt)
    except (WorkbenchError, gymnasium.error.Error) as error:
        return _failed(error, interrupt)
    except KeyboardInterrupt:
        print(f"{NODE}: interrupted before the training began", file=sys.stderr)
        return interrupt.exit_code or 130


def run(choice: Choice, name: str, argv: list[str], interrupt: Interrupt) -> int:
    """Brings up what is needed, trains or goes on, and ends what it brought up.

    Args:
        name: this node's full name.
        argv: the process's arguments, with roslaunch's remappings.

    Returns:
        The exit code. A failure that the user can mend is one line; what was learned is saved.

    Raises:
        WorkbenchError: if the run folder can't be made, or a training runs in it.
    """
    # Slow to import, and --help needs none of it.
    from rl_workbench.training.pg.run import Training, say

    folder = (choice.resume or _new_folder(choice.run)).resolve()
    with contextlib.ExitStack() as closing:
        closing.callback(run_folder.remove_if_empty, folder)
        closing.enter_context(run_folder.held(folder))
        try:
            stage = _stage(choice.run, name, argv, say, closing)
            training = Training(choice, folder, stage, interrupt)
            interrupt.defer()
            training.run()
        except (WorkbenchError, gymnasium.error.Error) as error:
            return _failed(error, interrupt)  # before the closing: a hung simulator takes its time
        finally:
            interrupt.defer()
    return interrupt.exit_code


def _new_folder(run: Settings) -> Path:
    name = "cartpole" if run.is_robot else run.env_id
    return run_folder.create(run.run_dir or None, name, run.exp_name, run.seed)


def _stage(
    run: Settings,
    name: str,
    argv: list[str],
    say: Callable[[str], None],
    closing: contextlib.ExitStack,
) -> "Stage":
    """The environments; `closing` ends them, and what was started for them."""
    from rl_workbench.training.pg.stage import gymnasium_stage, robot_stage

    if not run.is_robot:
        stage = gymnasium_stage(run.env_id, run.env_kwargs)
        closing.callback(stage.close)
        return stage
    if run.over_ros:
        from robot_envs.backends.session import RosSession

        session = RosSession(ROBOT, name, argv, run.realtime, run.gui, run.seed, height=0.0)
        closing.callback(session.close)
        session.start(say)
        robot = session.connect(None if run.realtime else CONTROL_PERIOD)
    else:
        from robot_envs.backends.in_process import InProcessRobot

        robot = InProcessRobot(ROBOT, CONTROL_PERIOD)
    closing.callback(robot.close)
    return robot_stage(robot, run.start_noise)


def _failed(error: Exception, interrupt: Interrupt) -> int:
    print(f"{NODE}: {error}", file=sys.stderr, flush=True)
    return interrupt.exit_code or 1
