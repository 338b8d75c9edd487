"""The command pg_train.py: trains the cart-pole by policy gradient, over ROS in lock-step by default."""

import contextlib
import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

from cartpole import NAMESPACE
from cartpole.workbench import PROGRAM, recommend_ws, ros_options
from rl_workbench.errors import WorkbenchError
from rl_workbench.option import Options, check_options, option
from rl_workbench.starting import Interrupt, run_command
from rl_workbench.training.options import TrainingOptions
from rl_workbench.training.progress import tell
from rl_workbench.training.train import choose_training, flag, new_parser, page_of, run_training
from robot_envs.backends import has_ros, need_ros
from robot_envs.errors import RobotEnvError

NODE = "pg_train"
PROG = f"{NODE}.py"
ENV_ID = f"{NAMESPACE}/Balance-v0"
WINDOWS = ("rviz", "headless")  # options that a resumed training may change
LARGEST_NOISE = 0.2  # [m], [rad]; just inside the angle at which an episode ends


@dataclass(frozen=True)
class RobotOptions:
    """Where the robot is, and how its episodes start; raises WorkbenchError for values outside the limits."""

    backend: str | None = option(
        None, "ros: a simulator over ROS, which is started if none runs; bullet: in this process, "
        "bit-identical and several times as fast (default: ros if it is installed)",
        choices=("ros", "bullet"),
    )  # fmt: skip
    realtime: bool = option(False, "let the world run in real time, as the existing script does")
    start_noise: float = option(
        0.0, "episodes start within +-X of the origin [m] and of upright [rad]; 0, as in the "
        "existing script: no noise", 0, LARGEST_NOISE,
    )  # fmt: skip
    rviz: bool = option(False, "show the robot in RViz")
    headless: bool = option(False, "show no window")

    def __post_init__(self) -> None:
        check_options(self)
        if self.backend == "bullet" and (self.realtime or self.rviz):
            raise WorkbenchError("--realtime and --rviz need a simulator over ROS: not with --backend bullet")

    @property
    def environment(self) -> dict[str, Any]:
        """Returns these options as options of the environment."""
        noise = {"noise": self.start_noise} if self.start_noise else {}
        if not self.realtime:
            installed = "ros" if has_ros() else "bullet"
            return {"backend": self.backend or installed, **noise}
        # Like the existing script, take the newest joint state without waiting.
        return {"backend": "ros-realtime", "control_period": 0.0, **noise}


ROBOT_OPTIONS = Options(RobotOptions)
_ANYWHERE = (False, 0.0, "bullet")  # values that suit every environment


def main(argv: list[str] | None = None) -> int:
    """Runs the command line; returns the process's exit code."""
    recommend_ws()
    words = sys.argv[1:] if argv is None else argv

    def command(interrupt: Interrupt) -> None:
        flags, parameters, name = ros_options(words, NODE)
        options, robot = choose(flags, parameters)
        # The cart-pole is trained over ROS.
        over_ros = options.run.env_id.startswith(f"{NAMESPACE}/") and _backend(options) != "bullet"
        # A single robot over ROS is shown in its simulator's window.
        in_window = over_ros and options.run.num_envs == 1
        callbacks = [] if in_window else page_of(options, PROGRAM)
        # Left before an error is printed: that line comes last, below what ends with the session.
        with contextlib.ExitStack() as beside:

            def begin() -> None:
                if over_ros:
                    beside.enter_context(session(options, name, words, robot))

            run_training(options, interrupt, begin, callbacks)

    return run_command(PROG, command, RobotEnvError)


def choose(flags: list[str], parameters: dict[str, Any]) -> tuple[TrainingOptions, RobotOptions]:
    """Reads the options of training and robot from flags and private parameters; exits with 2 if wrong."""
    parser = new_parser(PROG, add_help=False)
    ROBOT_OPTIONS.add_flags(parser.add_argument_group("the robot"))
    known, rest = parser.parse_known_args(flags)
    own = {key: value for key, value in parameters.items() if key in ROBOT_OPTIONS.names}
    others = {key: value for key, value in parameters.items() if key not in own}
    try:
        given = ROBOT_OPTIONS.read(own, "rosparam") | vars(known)
        robot = ROBOT_OPTIONS.make(RobotOptions, given)
        options = choose_training(rest, others, PROG, "reinforce", ENV_ID, parser)
        return _combined(options, robot, given), robot
    except WorkbenchError as error:
        parser.error(str(error))


def _combined(options: TrainingOptions, robot: RobotOptions, given: dict[str, Any]) -> TrainingOptions:
    if robot.headless and options.session.gui:
        raise WorkbenchError("--headless: not with --gui")
    run = options.run
    for key in ("realtime", "rviz"):
        if getattr(robot, key) and run.num_envs > 1:
            text = f"--{key} is for a single simulator: num_envs must be 1, not {run.num_envs}"
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
            raise WorkbenchError(f"{flag(robots[0])} is for the cart-pole: not with --env-id {run.env_id}")
        return options
    environment = robot.environment
    if "backend" in run.training_environment and not (robot.backend or robot.realtime):
        del environment["backend"]  # the default must not override it
    return options._replace(run=replace(run, train_env_kwargs=run.train_env_kwargs | environment))


def _backend(options: TrainingOptions) -> str:
    return str(options.run.training_environment.get("backend", "bullet"))


@contextlib.contextmanager
def session(options: TrainingOptions, name: str, argv: list[str], robot: RobotOptions) -> Iterator[None]:
    """Runs the robot's ROS session until the block ends."""
    backend = _backend(options)
    need_ros(f"the backend {backend}")
    from cartpole.robot import ROBOT
    from robot_envs.backends.ros.session import RosSession

    # With several environments each has its own simulator, and the session's evaluates the policy.
    gui = options.session.gui and options.run.num_envs == 1
    realtime, seed = backend == "ros-realtime", options.run.seed
    opened = RosSession(ROBOT, name, argv, realtime, gui, seed, robot.rviz)
    try:
        opened.start(tell)
        yield
    finally:
        opened.close()
