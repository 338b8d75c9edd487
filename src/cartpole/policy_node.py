"""The command policy_node.py: moves a robot over ROS with a trained policy."""

import argparse
import math
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium
from gymnasium import spaces

from cartpole.workbench import recommend_ws, ros_options
from rl_workbench.errors import WorkbenchError, error_line
from rl_workbench.starting import Interrupt, run_command
from rl_workbench.tools.flags import WHICH, env_options, number
from rl_workbench.tools.runs import open_run
from rl_workbench.training.progress import tell
from robot_envs.backends import IN_PROCESS, LOCKSTEP, REALTIME, need_ros
from robot_envs.environment import RobotEnv
from robot_envs.errors import RobotEnvError
from robot_envs.robot import Robot
from robot_envs.task import Task

NODE = "policy_node"
OVER_ROS = (LOCKSTEP, REALTIME)
DESCRIPTION = """\
A trained policy moves a robot over ROS, simulated or real. The node subscribes to /joint_states and publishes
the policy's commands to the controllers, each control period of ROS time, with the robot and the task of the
run's environment. Commands stay within the URDF's limits. When joint states are late the robot stops, and
continues when they come; Ctrl-C stops it and ends. Robot and controllers have to run: nothing is started or
spawned.

RUN is a run folder, or a file written by `workbench.py export`."""
EPILOG = """\
Each option is a private parameter, too: <param name="late" value="0.2"/>, _late:=0.2
Exit codes: 0 done, 1 failed, 2 wrong arguments; 130 after Ctrl-C."""


class Deployed(NamedTuple):
    """A policy with its robot and task."""

    robot: Robot
    task: Task
    act: Callable[[Any], Any]  # returns the action for the task's observation
    period: float  # [s], control period


def main(argv: list[str] | None = None) -> int:
    """Runs the command line; returns the process's exit code."""
    recommend_ws()
    words = sys.argv[1:] if argv is None else argv

    def command(interrupt: Interrupt) -> None:
        flags, parameters, name = ros_options(words, NODE)
        arguments = parse(flags, parameters)
        need_ros("it")
        tell(f"loading the policy of {arguments.run}")
        with interrupt.reading():
            from robot_envs.deployment.policy_node import PolicyNode, run_node

            robot, task, act, period = load(arguments.run, arguments.checkpoint, env_options(arguments))
        interrupt.defer()
        way = arguments.max_speed or math.inf

        def make() -> PolicyNode:
            late, seed, goal = arguments.late, arguments.seed, arguments.goal
            return PolicyNode(robot, task, act, period, late, seed, goal, way)

        try:
            run_node(name, words, make, interrupt.requested)
        except RobotEnvError:
            raise
        except Exception as error:  # of the user's task; the robot has stopped
            text = f"the robot is stopped, the task failed: {error_line(error)}"
            raise RobotEnvError(text) from error

    return run_command(f"{NODE}.py", command, RobotEnvError)


def parse(flags: list[str], parameters: dict[str, Any]) -> argparse.Namespace:
    """Parses flags and private parameters, which flags override; exits with 2 if they are wrong."""
    parser = argparse.ArgumentParser(
        f"{NODE}.py",
        description=DESCRIPTION,
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    add = parser.add_argument
    add("run", type=Path, metavar="RUN", help="a run folder, or an exported policy")
    add("--checkpoint", choices=WHICH, default="best",
        help="checkpoint of a run folder: best by evaluation, or the newest (default best)")  # fmt: skip
    add("--late", type=_positive, metavar="S",
        help="the robot stops when joint states are older [s] (default 5 control periods, "
        "at least 0.1, for a vehicle at most 0.3)")  # fmt: skip
    add("--max-speed", type=_share, default=1.0, metavar="SHARE",
        help="how fast commanded positions may move, as a share of the joints' velocity limits "
        "(default 1; 0: no limit)")  # fmt: skip
    add("--goal", type=_numbers, metavar="X,Y,...",
        help="goal of a task with goals (default: drawn); the topic ~goal takes others")  # fmt: skip
    add("--seed", type=number(0), default=0, metavar="N",
        help="seed of what the task draws (default 0)")  # fmt: skip
    add("--env-kwargs", nargs="+", default=[], metavar="KEY=VALUE",
        help="options of the environment, such as the task's; separate several by commas")  # fmt: skip
    named = [f"--{name.replace('_', '-')}={_text(value)}" for name, value in parameters.items()]
    return parser.parse_args([*named, *flags])


def _text(value: Any) -> str:
    return ",".join(map(str, value)) if isinstance(value, list) else str(value)


def _numbers(text: str) -> list[float]:
    return [float(each) for each in text.split(",")]


def _positive(text: str) -> float:
    value = float(text)
    if not 0.0 < value < math.inf:
        raise argparse.ArgumentTypeError(f"must be above 0: {text}")
    return value


def _share(text: str) -> float:
    return 0.0 if float(text) == 0.0 else _positive(text)


def load(path: Path, which: str, options: dict[str, Any]) -> Deployed:
    """Loads the policy of a run folder or an exported file, with its robot and task.

    `which` is the checkpoint of a run folder; `options` of the environment are added to the training's.
    Raises WorkbenchError if there is no such policy or environment, RobotEnvError unless it has exactly one
    robot.
    """
    # They import torch, for which --help need not wait.
    from rl_workbench.tools.policies import load_learned
    from rl_workbench.tools.torchscript import described, open_exported
    from rl_workbench.training.environments import make_environment

    if path.is_dir():
        run = open_run(path)
        _check_bare(path, run.wrapper)
        learned = load_learned(run, which, _in_process({**run.env_kwargs, **options}))
        env, env_id, act = learned.env, run.env_id, learned.act
    else:
        exported = open_exported(path)
        _check_bare(path, exported.metadata.get("wrapper"))
        env_id, act = exported.metadata["env_id"], exported.act
        recorded = {**exported.metadata["env_kwargs"], **options}
        sees_dict = exported.metadata["observation_space"].get("kind") == "Dict"
        env = make_environment(env_id, _in_process(recorded), keep_dict=sees_dict)
    try:
        for name in () if path.is_dir() else ("observation_space", "action_space"):
            space = getattr(env, name)
            if exported.metadata[name] != described(space):
                raise WorkbenchError(
                    f"{path} was exported for another {name.replace('_', ' ')} than {env_id} has now: {space}"
                )
        base = env.unwrapped
        if not isinstance(base, RobotEnv):
            raise RobotEnvError(f"{path} is a policy of {env_id}, which is not an environment of a robot")
        if base.scene.several:
            raise RobotEnvError(f"{path} is a policy of {env_id}, which has several robots")
        return Deployed(base.scene.robots[0], base.task, _of_task(env, act), base.control_period)
    finally:
        env.close()


def _check_bare(path: Path, wrapper: str | None) -> None:
    if wrapper:
        raise RobotEnvError(f"{path} learned through the wrapper {wrapper}, which a robot hasn't")


def _in_process(options: dict[str, Any]) -> dict[str, Any]:
    """Returns the options for an environment in this process: only its robot and task are needed."""
    if options.get("backend") in OVER_ROS:
        options["backend"] = IN_PROCESS
    if options.get("control_period") == 0.0:  # real time, one action per joint state
        options["control_period"] = None
    return options


def _of_task(env: gymnasium.Env[Any, Any], act: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """Returns the policy as a function of the task's observations, which the training may have flattened."""
    from rl_workbench.training.environments import as_float32

    own = env.unwrapped.observation_space
    if env.observation_space == own:
        return lambda observation: act(as_float32(observation))
    return lambda observation: act(as_float32(spaces.flatten(own, observation)))
