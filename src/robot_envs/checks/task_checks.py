"""What a task is and returns, checked: one line says which method, and what it should be."""

import math
import textwrap
from collections.abc import Iterable
from typing import Any

import gymnasium
import numpy as np

from robot_envs.errors import TaskError
from robot_envs.task import GoalTask, Task
from robot_envs.world_state import LinkQuery, StateQuery


def check_task(task: Any) -> None:
    """Makes sure that it is one, and that what it says once fits together.

    Raises:
        TaskError: if something doesn't.
    """
    if isinstance(task, type) and issubclass(task, Task):
        raise TaskError(f"a task is an object, {task.__name__}(...), and not the class")
    if not isinstance(task, Task):
        raise TaskError(f"a task is an object of a class of robot_envs.Task, not {task!r}")
    name = type(task).__name__
    if not isinstance(task.objects, Iterable):
        raise TaskError(f"{name}.objects lists objects: (Object(...),), not {short(task.objects)}")
    _check_query(name, task.query)


def check_steps(most: Any) -> None:
    """Makes sure that episodes can be cut off after so many steps; None: never.

    Raises:
        TaskError: if they can't.
    """
    if most is not None and (not isinstance(most, (int, np.integer)) or most < 1):
        raise TaskError(f"max_steps must be at least 1, and a whole number, not {most!r}")


def _check_query(name: str, query: Any) -> None:
    if not isinstance(query, StateQuery):
        raise TaskError(f"{name}.query is a StateQuery(...), not {query!r}")
    for each in query.links:
        if not isinstance(each, LinkQuery):
            raise TaskError(f'{name}.query: links lists LinkQuery("NAME"), not {each!r}')
    lists: tuple[tuple[str, Any], ...] = (
        ("models", query.models),
        ("contacts_of", query.contacts_of),
    )
    for what, names in lists:
        if isinstance(names, str):
            raise TaskError(f"{name}.query: {what} lists names: ({names!r},), and not {names!r}")


def space(task: Task, method: str) -> gymnasium.Space[Any]:
    """What a task's method makes, which must be a space.

    Raises:
        TaskError: if it is none.
    """
    made = getattr(task, method)()
    if not isinstance(made, gymnasium.Space):
        raise wrong(task, method, made, "a gymnasium.Space")
    return made


def number(task: Task, method: str, given: Any) -> float:
    """A finite number that a method has returned.

    Raises:
        TaskError: if it is none.
    """
    try:
        found = float(given)
    except (TypeError, ValueError):
        found = math.nan
    if not math.isfinite(found):
        raise wrong(task, method, given, "a finite number")
    return found


def flag(task: Task, method: str, given: Any) -> bool:
    """A yes or no that a method has returned.

    Raises:
        TaskError: if it is neither.
    """
    if not isinstance(given, (bool, np.bool_)):
        raise wrong(task, method, given, "True or False")
    return bool(given)


def told(task: Task, given: Any) -> dict[str, Any]:
    """What `info` has returned.

    Raises:
        TaskError: if it is no dict.
    """
    if not isinstance(given, dict):
        raise wrong(task, "info", given, "a dict")
    return given


def goal(task: GoalTask, method: str, given: Any, like: np.ndarray) -> np.ndarray:
    """A goal that a method has returned.

    Raises:
        TaskError: if it has another shape than the episode's, or isn't finite.
    """
    try:
        found = np.asarray(given, like.dtype)
    except (TypeError, ValueError):
        found = np.array(math.nan)
    if found.shape != like.shape or not math.isfinite(found.sum()):
        raise wrong(task, method, given, f"finite numbers of the shape {like.shape}")
    return found


def short(given: Any) -> str:
    """How Python shows it, in less than a line or two."""
    return textwrap.shorten(repr(given), 160, placeholder=" ...")


def wrong(task: Task, method: str, given: Any, wanted: str) -> TaskError:
    return TaskError(
        f"{type(task).__name__}.{method}() returned {short(given)}; it must be {wanted}"
    )
