"""Checks of what a task defines and returns; each error names the method and what it should be."""

import math
import operator
import textwrap
from collections.abc import Callable, Iterable
from typing import Any

import gymnasium
import numpy as np

from robot_envs.errors import TaskError
from robot_envs.task import GoalTask, Task
from robot_envs.world_state import LinkQuery, StateQuery, WorldState

FEW = 64  # numbers that are checked faster one by one


def action_reader(space: gymnasium.Space[Any]) -> Callable[[Any], Any]:
    """Returns what checks an action; it raises ValueError for what is none of the space."""
    if isinstance(space, gymnasium.spaces.Discrete):
        return _discrete_reader(space)
    if isinstance(space, gymnasium.spaces.Box):
        return _box_reader(space)

    def read(action: Any) -> Any:
        if not space.contains(action):
            raise ValueError(f"an action is of {space}, not {action!r}")
        return action

    return read


def _discrete_reader(space: gymnasium.spaces.Discrete) -> Callable[[Any], int]:
    first, end = int(space.start), int(space.start + space.n)
    told = (
        f"{first} or {end - 1}" if end - first == 2 else f"a whole number from {first} to {end - 1}"
    )

    def read(action: Any) -> int:
        try:
            if first <= (index := operator.index(action)) < end:
                return index
        except TypeError:  # a fraction, or none
            pass
        raise ValueError(f"an action is {told}, not {action!r}")

    return read


def _box_reader(space: gymnasium.spaces.Box) -> Callable[[Any], np.ndarray]:
    shape, dtype, low, high = space.shape, space.dtype, space.low, space.high

    def read(action: Any) -> np.ndarray:
        try:
            array = np.asarray(action, dtype)
            if array.shape == shape and ((low <= array) & (array <= high)).all():  # NaN isn't
                return array
        except (TypeError, ValueError):  # no numbers
            pass
        raise ValueError(f"an action is of {space}, not {action!r}")

    return read


def observation_reader(space: gymnasium.Space[Any], task: str) -> Callable[[Any], Any]:
    """Returns what makes an observation of what a task returns; it raises TaskError where that can't be.

    Numbers beyond the space's bounds are let through, as Gymnasium does.

    Args:
        space: of the observations.
        task: its class, for the error.
    """
    if isinstance(space, gymnasium.spaces.Box):
        return _numbers_reader(space, task)

    def read(observed: Any) -> Any:
        if not space.contains(observed):
            raise TaskError(f"{task}.observe() returned what isn't of {space}: {observed!r}")
        return observed

    return read


def _numbers_reader(space: gymnasium.spaces.Box, task: str) -> Callable[[Any], np.ndarray]:
    shape, dtype, few = space.shape, space.dtype, len(space.shape) == 1 and space.shape[0] <= FEW

    def read(observed: Any) -> np.ndarray:
        try:
            array = np.asarray(observed, dtype)
        except (TypeError, ValueError) as error:  # no numbers
            raise TaskError(
                f"{task}.observe() returned {observed!r}, which isn't of {space}"
            ) from error
        if array.shape != shape:
            raise TaskError(
                f"{task}.observe() returned the shape {array.shape}; its observation_space has {shape}"
            )
        if few and math.isfinite(sum(array.tolist())):  # which is quicker, for few numbers
            return array
        if not np.isfinite(array).all():
            raise TaskError(f"{task}.observe() returned numbers that aren't finite: {array}")
        return array

    return read


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


def made_space(task: Task, method: str) -> gymnasium.Space[Any]:
    """What a task's method makes, which must be a space.

    Raises:
        TaskError: if it is none.
    """
    made = getattr(task, method)()
    if not isinstance(made, gymnasium.Space):
        raise _wrong(task, method, made, "a gymnasium.Space")
    return made


def checked_number(task: Task, method: str, given: Any) -> float:
    """A finite number that a method has returned.

    Raises:
        TaskError: if it is none.
    """
    try:
        found = float(given)
    except (TypeError, ValueError):
        found = math.nan
    if not math.isfinite(found):
        raise _wrong(task, method, given, "a finite number")
    return found


def checked_flag(task: Task, method: str, given: Any) -> bool:
    """A yes or no that a method has returned.

    Raises:
        TaskError: if it is neither.
    """
    if not isinstance(given, (bool, np.bool_)):
        raise _wrong(task, method, given, "True or False")
    return bool(given)


def checked_info(task: Task, given: Any) -> dict[str, Any]:
    """What `info` has returned.

    Raises:
        TaskError: if it is no dict.
    """
    if not isinstance(given, dict):
        raise _wrong(task, "info", given, "a dict")
    return given


def checked_goal(task: GoalTask, method: str, given: Any, like: np.ndarray) -> np.ndarray:
    """A goal that a method has returned.

    Raises:
        TaskError: if it has another shape than the episode's, or isn't finite.
    """
    try:
        found = np.asarray(given, like.dtype)
    except (TypeError, ValueError):
        found = np.array(math.nan)
    if found.shape != like.shape or not math.isfinite(found.sum()):
        raise _wrong(task, method, given, f"finite numbers of the shape {like.shape}")
    return found


def short(given: Any) -> str:
    """How Python shows it, in less than a line or two."""
    return textwrap.shorten(repr(given), 160, placeholder=" ...")


def _wrong(task: Task, method: str, given: Any, wanted: str) -> TaskError:
    return TaskError(
        f"{type(task).__name__}.{method}() returned {short(given)}; it must be {wanted}"
    )


def goal_space(task: GoalTask, observations: gymnasium.Space[Any]) -> gymnasium.spaces.Dict:
    """Of the observations of a goal environment.

    Raises:
        TaskError: if the task's goals are no Box.
    """
    goals = made_space(task, "goals"), made_space(task, "goals")
    if not isinstance(goals[0], gymnasium.spaces.Box):
        raise _wrong(task, "goals", goals[0], "a gymnasium.spaces.Box")
    return gymnasium.spaces.Dict(
        {"observation": observations, "achieved_goal": goals[0], "desired_goal": goals[1]}
    )


def set_goal(
    task: GoalTask, state: WorldState, rng: np.random.Generator, wanted: Any = None
) -> None:
    """Gives a task the goal of an episode.

    Args:
        task: the task.
        state: in which the episode begins.
        rng: of the environment; a goal is drawn in any case, so that the stream doesn't depend on it.
        wanted: another one than the task draws; None: that one.

    Raises:
        TaskError: if the goal isn't one of the task's.
    """
    drawn = task.goal(rng, state)
    given, space = drawn if wanted is None else wanted, task.goals()
    try:
        goal = np.asarray(given, space.dtype)
    except (TypeError, ValueError):  # no numbers
        goal = np.array(math.nan)
    if not space.contains(goal):
        raise TaskError(f"the goal {given} isn't one of {type(task).__name__}'s goals: {space}")
    task.desired = goal


def with_goals(task: GoalTask, seen: Any, state: WorldState) -> dict[str, Any]:
    """What an environment of this task observes.

    Args:
        task: whose episode has a goal.
        seen: what `observe` returned, in the form of its space.
        state: of which that is.

    Raises:
        TaskError: if what the state achieves is no goal.
    """
    achieved = checked_goal(task, "achieved", task.achieved(state), task.desired)
    return {
        "observation": seen,
        "achieved_goal": achieved,
        "desired_goal": task.desired.copy(),
    }
