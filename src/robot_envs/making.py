"""Gymnasium's entry points: environments from the names of a robot and a task."""

import importlib
import inspect
from collections.abc import Callable, Iterable
from typing import Any, TypeVar

from file_access.text import did_you_mean, nearest_or_all
from robot_envs.checks import short
from robot_envs.environment import RobotEnv
from robot_envs.errors import RobotEnvError
from robot_envs.pictures.drawn import RENDER_MODES
from robot_envs.robot import Robot
from robot_envs.task import Task
from robot_envs.vector import RobotVectorEnv

NAMED = ("robot", "task")  # options of RobotEnv that are given by name here

Maker = TypeVar("Maker", bound=Callable[..., RobotEnv])


def rendering(make: Maker) -> Maker:
    """Tells `gymnasium.make` an entry point's render modes: from these it makes "rgb_array_list"."""
    vars(make)["metadata"] = {"render_modes": list(RENDER_MODES)}
    return make


@rendering
def make_environment(robot: str, task: str, backend: str | None = None, **options: Any) -> RobotEnv:
    """Makes an environment of a robot and a task; see `register`.

    `options` are `RobotEnv`'s; all others are the task's. Raises RobotEnvError for an unknown one or a name
    that isn't found, ValueError for an option that makes no sense.
    """
    make_task = named(task)
    is_class = isinstance(make_task, type)
    if not callable(make_task) or (is_class and not issubclass(make_task, Task)):
        raise RobotEnvError(f"{task} is {short(make_task)}, which is not a subclass of robot_envs.Task")
    known = option_names(RobotEnv)
    own = {name: value for name, value in options.items() if name in known}
    others = {name: value for name, value in options.items() if name not in known}
    check_options(others, option_names(make_task))
    made = make_task(**others)
    if not isinstance(made, Task):
        raise RobotEnvError(f"{task} makes {short(made)}, which is not a robot_envs.Task")
    return RobotEnv(_robots(robot), made, backend, **own)


def make_vector(num_envs: int, **options: Any) -> RobotVectorEnv:
    """Makes a vector of environments; see `make_environment`."""
    return RobotVectorEnv(num_envs, make_environment, **options)


def _robots(name: str) -> Any:
    attribute = named(name)
    robots = attribute() if _takes_nothing(attribute) and not isinstance(attribute, type) else attribute
    listed = [robots] if isinstance(robots, Robot) else robots
    if not isinstance(listed, (list, tuple)) or not all(isinstance(each, Robot) for each in listed):
        raise RobotEnvError(
            f"{name} is {short(robots)}, which is not a robot_envs.Robot, a list of them, or a "
            "function without arguments that returns them"
        )
    return robots


def _takes_nothing(found: Any) -> bool:
    """Returns whether it is a function that can be called without arguments."""
    if not callable(found):
        return False
    try:
        inspect.signature(found).bind()
    except TypeError:
        return False
    return True


def check_options(given: Iterable[str], known: Iterable[str] = ()) -> None:
    """Raises RobotEnvError for an option that neither `RobotEnv` nor `known` has."""
    names = [*option_names(RobotEnv), *known]
    for name in given:
        if name not in names:
            near = nearest_or_all(name, names)
            raise RobotEnvError(f"this environment has no option '{name}'{near}")


def option_names(make: Callable[..., Any]) -> list[str]:
    """Returns the keyword arguments of a class (its bases' with defaults for `**options`) or function."""
    names: dict[str, None] = {}
    for maker in inspect.getmro(make) if isinstance(make, type) else [make]:
        parameters = inspect.signature(maker).parameters.values()
        more = [each for each in parameters if each.kind == each.VAR_KEYWORD]
        for each in parameters:
            given = maker is not make and each.default is each.empty
            if each not in more and each.name not in NAMED and not given:
                names[each.name] = None
        if not more:
            break
    return list(names)


def named(name: str) -> Any:
    """Imports "module:attribute"; raises RobotEnvError if there is no such module or attribute."""
    module, colon, attribute = name.partition(":")
    if not colon:
        raise RobotEnvError(f"'{name}' must be written as module:attribute")
    try:
        imported = importlib.import_module(module)
    except ModuleNotFoundError as error:
        if error.name is None or not f"{module}.".startswith(f"{error.name}."):
            raise  # the module exists, and imports one that doesn't
        raise RobotEnvError(
            f"there is no module '{module}' (of '{name}'); ./ws --with FOLDER ... finds those in FOLDER"
        ) from error
    if not hasattr(imported, attribute):
        raise RobotEnvError(
            f"{module} ({imported.__file__}) has no '{attribute}'{did_you_mean(attribute, dir(imported))}"
        )
    return getattr(imported, attribute)
