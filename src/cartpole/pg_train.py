"""The command pg_train.py: trains the cart-pole, over ROS in lock-step unless told otherwise."""

import argparse
import contextlib
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from cartpole import NAMESPACE
from cartpole.workbench import PROGRAM, ros_options
from rl_workbench.errors import WorkbenchError
from rl_workbench.option import Options, check_options, option
from rl_workbench.starting import Interrupt, reader_may_go
from rl_workbench.training.command_line import USAGE, choose_training, flag
from rl_workbench.training.options import TrainingOptions
from rl_workbench.training.progress import tell
from rl_workbench.training.train import run_training, shown
from robot_envs.backends import has_ros, need_ros
from robot_envs.errors import RobotEnvError

NODE = "pg_train"
PROG = f"{NODE}.py"
ENV_ID = f"{NAMESPACE}/Balance-v0"
WINDOWS = ("rviz", "headless")  # what a resumed training may have otherwise
LARGEST_NOISE = 0.2  # [m], [rad]; just inside the angle at which an episode ends


@dataclass(frozen=True)
class RobotOptions:
    """Where the robot is, and how its episodes start.

    Raises:
        WorkbenchError: if a value is beyond its limits.
    """

    backend: str | None = option(
        None, "ros: the robot in a simulator over ROS, which is started if none runs; bullet: in this "
        "process, with the same bits, several times as fast; ros where ROS is installed",
        choices=("ros", "bullet"),
    )  # fmt: skip
    realtime: bool = option(False, "let the world run by itself, as the existing script does")
    start_noise: float = option(
        0.0, "episodes start within +-X of the origin [m] and of upright [rad]; 0, as the existing "
        "script does, starts them all alike", 0, LARGEST_NOISE,
    )  # fmt: skip
    rviz: bool = option(False, "show the robot in RViz")
    headless: bool = option(False, "no window")

    def __post_init__(self) -> None:
        check_options(self)
        if self.backend == "bullet" and (self.realtime or self.rviz):
            raise WorkbenchError(
                "--realtime and --rviz are of a simulator over ROS: not with --backend bullet"
            )

    @property
    def environment(self) -> dict[str, Any]:
        """What it comes to as options of the environment."""
        noise = {"noise": self.start_noise} if self.start_noise else {}
        if not self.realtime:
            installed = "ros" if has_ros() else "bullet"
            return {"backend": self.backend or installed, **noise}
        # The newest joint state, without waiting for another one: as the existing script does.
        return {"backend": "ros-realtime", "control_period": 0.0, **noise}


ROBOT_OPTIONS = Options(RobotOptions)
_ANYWHERE = (False, 0.0, "bullet")  # what goes for other environments, too


@reader_may_go()
def main(argv: list[str] | None = None) -> int:
    """Trains as the arguments say; returns the process's exit code."""
    argv = sys.argv[1:] if argv is None else argv
    interrupt = Interrupt().install()
    try:
        flags, parameters, name = ros_options(argv, NODE)
        options, robot = choose(flags, parameters)
        with contextlib.ExitStack() as beside:

            def begin(folder: Path) -> None:
                if needs_session(options):
                    beside.enter_context(session(options, name, argv, robot, folder))
                if not shows_itself(options):
                    beside.enter_context(shown(options, folder, PROGRAM))

            return _train(options, interrupt, begin)
    except (WorkbenchError, RobotEnvError) as error:
        return _failed(error, interrupt)
    except KeyboardInterrupt:
        print(f"{PROG}: interrupted before the training began", file=sys.stderr)
        return interrupt.exit_code or 130
    finally:
        interrupt.defer()


def _train(options: TrainingOptions, interrupt: Interrupt, begin: Callable[[Path], None]) -> int:
    """Tells of a failure before the session is closed: a simulator that hangs takes its time."""
    try:
        run_training(options, interrupt, begin)
        return interrupt.exit_code
    except WorkbenchError as error:
        return _failed(error, interrupt)


def _failed(error: Exception, interrupt: Interrupt) -> int:
    print(f"{PROG}: {error}", file=sys.stderr, flush=True)
    return interrupt.exit_code or 1


def choose(flags: list[str], parameters: dict[str, Any]) -> tuple[TrainingOptions, RobotOptions]:
    """What the arguments say of the training and of the robot.

    Raises:
        SystemExit: with code 2 and a usage line, if they are wrong; with 0 after --help.
    """
    parser = argparse.ArgumentParser(
        PROG,
        usage=USAGE.format(prog=PROG),
        add_help=False,
        allow_abbrev=False,
        argument_default=argparse.SUPPRESS,
    )
    ROBOT_OPTIONS.add_flags(parser.add_argument_group("the robot"))
    known, rest = parser.parse_known_args(flags)
    own = {key: value for key, value in parameters.items() if key in ROBOT_OPTIONS.names}
    others = {key: value for key, value in parameters.items() if key not in own}
    try:
        given = ROBOT_OPTIONS.read(own, "rosparam") | vars(known)
        robot = ROBOT_OPTIONS.make(RobotOptions, given)
        options = choose_training(rest, others, PROG, "reinforce", ENV_ID, parser)
        return _joined(options, robot, given), robot
    except WorkbenchError as error:
        parser.error(str(error))


def _joined(
    options: TrainingOptions, robot: RobotOptions, given: dict[str, Any]
) -> TrainingOptions:
    if robot.headless and options.session.gui:
        raise WorkbenchError("--headless: not with --gui")
    run = options.run
    for key in ("realtime", "rviz"):
        if getattr(robot, key) and run.num_envs > 1:
            text = f"--{key} is of the robot of one simulator: num_envs is 1, not {run.num_envs}"
            raise WorkbenchError(text)
    recorded = [key for key in given if key not in WINDOWS]
    if options.resume:
        if recorded:
            raise WorkbenchError(
                f"a resumed training keeps its settings: --resume allows no {flag(recorded[0])}"
            )
        return options
    if not run.env_id.startswith(f"{NAMESPACE}/"):
        robots = [key for key in [*recorded, "rviz"] if getattr(robot, key) not in _ANYWHERE]
        if robots:
            raise WorkbenchError(
                f"{flag(robots[0])} is of the robot: not with --env-id {run.env_id}"
            )
        return options
    environment = robot.environment
    if "backend" in run.training_environment and not (robot.backend or robot.realtime):
        del environment["backend"]  # it is what those get who name none
    return options._replace(run=replace(run, train_env_kwargs=run.train_env_kwargs | environment))


def needs_session(options: TrainingOptions) -> bool:
    """Whether a robot is trained that isn't in this process."""
    of_robot = options.run.env_id.startswith(f"{NAMESPACE}/")
    return of_robot and _backend(options) != "bullet"


def shows_itself(options: TrainingOptions) -> bool:
    """Whether the robot that is trained is seen in its simulator's window, not on a page beside the training.

    Of several environments each has a simulator of its own; in the session's the policy is
    evaluated.
    """
    return needs_session(options) and options.run.num_envs == 1


def _backend(options: TrainingOptions) -> str:
    return str(options.run.training_environment.get("backend", "bullet"))


@contextlib.contextmanager
def session(
    options: TrainingOptions, name: str, argv: list[str], robot: RobotOptions, folder: Path
) -> Iterator[None]:
    """What the robot needs to be running, for as long as it is trained.

    Args:
        options: of a training that needs it.
        name: this node's full name.
        argv: the process's arguments, with roslaunch's remappings.
        robot: whether RViz is to be opened.
        folder: of the training, whose curves are shown in the simulator's window.

    Raises:
        RobotEnvError: if something can't be started, or what runs doesn't fit.
    """
    backend = _backend(options)
    need_ros(f"the backend {backend}")
    from cartpole.robot import ROBOT
    from robot_envs.backends.ros.session import RosSession

    opened = RosSession(
        ROBOT,
        name,
        argv,
        realtime=backend == "ros-realtime",
        gui=options.session.gui and shows_itself(options),
        seed=options.run.seed,
        rviz=robot.rviz,
        curves=folder,
    )
    try:
        opened.start(tell)
        yield
    finally:
        opened.close()
