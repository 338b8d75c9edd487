"""Environments of robots and tasks by name: what stands behind `gymnasium.make`."""

import importlib
import inspect
from collections.abc import Callable, Iterable
from typing import Any

import gymnasium

from bullet_gazebo.state import did_you_mean
from robot_envs.checks.task_checks import short
from robot_envs.environment import RobotEnv
from robot_envs.errors import RobotEnvError
from robot_envs.robot import Robot
from robot_envs.task import Task

ENTRY_POINT = "robot_envs.making:make_environment"
VECTOR_ENTRY_POINT = "robot_envs.vector:make_vector"
OWN = ("robot", "task")  # of RobotEnv's options, that have another form here


def register(
    identifier: str,
    robot: str,
    task: str,
    *,
    reward_threshold: float | None = None,
    **options: Any,
) -> None:
    """Registers an environment with Gymnasium; again does no harm, and with other options replaces it.

        register("my_arm/Reach-v0", "my_arm.robot:ARM", "my_arm.tasks:Reach")
        env = gymnasium.make("my_arm/Reach-v0", backend="ros")
        eight = gymnasium.make_vec("my_arm/Reach-v0", 8, backend="ros")

    Robot and task are named, so that other processes can make them: workers, resumed trainings.

    Args:
        identifier: as Gymnasium has it: "namespace/Name-v0".
        robot: "module:attribute": a `Robot`, a list of them, or a function that returns one.
        task: "module:attribute": a class of `Task`, or a function that returns one.
        reward_threshold: the return from which on the task counts as solved.
        options: of `RobotEnv` or of the task; `gymnasium.make` may override them.
    """
    kwargs = {"robot": robot, "task": task, **options}
    known = gymnasium.registry.get(identifier)
    if known is None or (known.kwargs, known.reward_threshold) != (kwargs, reward_threshold):
        gymnasium.register(
            identifier,
            entry_point=ENTRY_POINT,
            vector_entry_point=VECTOR_ENTRY_POINT,
            reward_threshold=reward_threshold,
            kwargs=kwargs,
        )


def make_environment(robot: str, task: str, backend: str | None = None, **options: Any) -> RobotEnv:
    """Makes an environment.

    Args:
        robot: see `register`.
        task: see `register`.
        backend: see `RobotEnv`.
        options: those of `RobotEnv`; others are the task's.

    Raises:
        RobotEnvError: if robot or task aren't found, or nobody knows an option.
        ValueError: if an option makes no sense.
    """
    make_task = named(task)
    if not callable(make_task):
        raise RobotEnvError(f"{task} is {short(make_task)}, which is no class of robot_envs.Task")
    known = option_names(RobotEnv)
    own = {name: value for name, value in options.items() if name in known}
    others = {name: value for name, value in options.items() if name not in known}
    check_options(others, option_names(make_task))
    made = make_task(**others)
    if not isinstance(made, Task):
        raise RobotEnvError(f"{task} makes {short(made)}, which is no robot_envs.Task")
    return RobotEnv(_robots(robot), made, backend, **own)


def _robots(name: str) -> Any:
    found = named(name)
    robots = found() if _takes_nothing(found) else found
    listed = [robots] if isinstance(robots, Robot) else robots
    if not isinstance(listed, (list, tuple)) or not all(isinstance(each, Robot) for each in listed):
        raise RobotEnvError(
            f"{name} is {short(robots)}, which is no robot_envs.Robot, nor a list of them, nor a "
            "function without arguments that makes them"
        )
    return robots


def _takes_nothing(found: Any) -> bool:
    """Whether it is a function to be called without arguments."""
    if not callable(found):
        return False
    try:
        inspect.signature(found).bind()
    except TypeError:
        return False
    return True


def check_options(given: Iterable[str], known: Iterable[str] = ()) -> None:
    """Makes sure that options are known.

    Args:
        given: their names.
        known: those that there are beside `RobotEnv`'s.

    Raises:
        RobotEnvError: if one isn't.
    """
    names = [*option_names(RobotEnv), *known]
    for name in given:
        if name not in names:
            near = did_you_mean(name, names) or f"; there are {', '.join(names)}"
            raise RobotEnvError(f"this environment has no option '{name}'{near}")


def option_names(make: Callable[..., Any]) -> list[str]:
    """Names of the keyword arguments that a class or function takes; of `RobotEnv` without robot and task."""
    parameters = inspect.signature(make).parameters.values()
    return [
        each.name for each in parameters if each.kind != each.VAR_KEYWORD and each.name not in OWN
    ]


def named(name: str) -> Any:
    """What "module:attribute" stands for.

    Raises:
        RobotEnvError: if there is no such module, or it has no such attribute.
    """
    module, colon, attribute = name.partition(":")
    if not colon:
        raise RobotEnvError(f"'{name}' must be written as module:attribute")
    try:
        found = importlib.import_module(module)
    except ModuleNotFoundError as error:
        if error.name is None or not f"{module}.".startswith(f"{error.name}."):
            raise  # one that it imports itself
        raise RobotEnvError(
            f"there is no module '{module}' (of '{name}'); ./ws --with FOLDER finds those of a folder"
        ) from error
    if not hasattr(found, attribute):
        raise RobotEnvError(
            f"{module} ({found.__file__}) has no '{attribute}'{did_you_mean(attribute, dir(found))}"
        )
    return getattr(found, attribute)
