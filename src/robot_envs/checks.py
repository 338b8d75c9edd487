"""Validation of a task's definitions and results; each error names the method and the expected value."""

import math
import operator
import textwrap
from collections.abc import Callable, Iterable, Iterator
from typing import Any

import gymnasium
import numpy as np

from file_access.text import did_you_mean
from robot_envs.errors import TaskError
from robot_envs.robot import Robot
from robot_envs.snapshot import checked_snapshot
from robot_envs.task import GoalTask, Task
from robot_envs.world_state import InitialState, LinkQuery, StateQuery, WorldState

FLAGS = (bool, np.bool_)
RESET_OPTIONS = ("initial_state", "snapshot", "goal")
WANTED: dict[Any, str] = {
    FLAGS: "True or False",
    dict: "a dict",
    gymnasium.Space: "a gymnasium.Space",
    gymnasium.spaces.Box: "a gymnasium.spaces.Box",
}
FEW = 64  # numbers; fewer are checked faster one by one than by NumPy


def checked_period(robot: Robot, given: Any) -> float:
    """Returns a control period [s], by default the robot's; raises ValueError for anything but a number."""
    period = robot.control_period if given is None else given
    if not isinstance(period, (int, float)):
        raise ValueError(f"control_period is a number [s], not {period!r}")
    return period


def reset_options(task: Task, options: dict[str, Any]) -> dict[str, Any]:
    """Returns a reset's options; raises ValueError for one that the task doesn't have."""
    for name in options:
        if name not in RESET_OPTIONS:
            raise ValueError(f"reset knows no option '{name}'{did_you_mean(name, RESET_OPTIONS)}")
    if "goal" in options and not isinstance(task, GoalTask):
        raise ValueError(f"{type(task).__name__} has no goal; only a GoalTask does")
    if isinstance(options.get("snapshot"), Iterator):  # a vector's: one for each
        options = {**options, "snapshot": next(options["snapshot"])}
    if "snapshot" in options:
        checked_snapshot(options["snapshot"])
    if not isinstance(options.get("initial_state", InitialState()), InitialState):
        raise ValueError(f"initial_state is an InitialState, not {options['initial_state']!r}")
    return options


def action_reader(space: gymnasium.Space[Any]) -> Callable[[Any], Any]:
    """Returns a function that converts an action; it raises ValueError for one that isn't in the space."""
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
    expected = f"{first} or {end - 1}" if end - first == 2 else f"a whole number from {first} to {end - 1}"

    def read(action: Any) -> int:
        try:
            if first <= (index := operator.index(action)) < end:
                return index
        except TypeError:  # not a whole number
            pass
        raise ValueError(f"an action is {expected}, not {action!r}")

    return read


def _box_reader(space: gymnasium.spaces.Box) -> Callable[[Any], np.ndarray]:
    shape, dtype, low, high = space.shape, space.dtype, space.low, space.high

    def read(action: Any) -> np.ndarray:
        try:
            array = np.asarray(action, dtype)
            if array.shape == shape and ((low <= array) & (array <= high)).all():  # false for NaN
                return array
        except (TypeError, ValueError):  # no numbers
            pass
        raise ValueError(f"an action is of {space}, not {action!r}")

    return read


def observation_reader(space: gymnasium.Space[Any], task: str) -> Callable[[Any], Any]:
    """Returns a function that converts what a task observes; it raises TaskError for the wrong shape or type.

    Numbers beyond the space's bounds pass, as in Gymnasium.
    """
    if isinstance(space, gymnasium.spaces.Box):
        return _array_reader(space, task)

    def read(observed: Any) -> Any:
        if not space.contains(observed):
            raise TaskError(f"{task}.observe() returned a value outside {space}: {observed!r}")
        return observed

    return read


def _array_reader(space: gymnasium.spaces.Box, task: str) -> Callable[[Any], np.ndarray]:
    shape, dtype, few = space.shape, space.dtype, len(space.shape) == 1 and space.shape[0] <= FEW

    def read(observed: Any) -> np.ndarray:
        try:
            array = np.asarray(observed, dtype)
        except (TypeError, ValueError) as error:  # no numbers
            raise TaskError(f"{task}.observe() returned {observed!r}, which isn't of {space}") from error
        if array.shape != shape:
            raise TaskError(
                f"{task}.observe() returned the shape {array.shape}; its observation_space has {shape}"
            )
        if few and math.isfinite(sum(array.tolist())):
            return array
        if not np.isfinite(array).all():
            raise TaskError(f"{task}.observe() returned numbers that aren't finite: {array}")
        return array

    return read


def check_task(task: Any) -> None:
    """Raises TaskError if `task` is not a `Task`, or if its objects or its query can't be used."""
    if isinstance(task, type) and issubclass(task, Task):
        raise TaskError(f"a task is an object, {task.__name__}(...), and not the class")
    if not isinstance(task, Task):
        raise TaskError(f"a task is an object of a class of robot_envs.Task, not {task!r}")
    name = type(task).__name__
    if not isinstance(task.objects, Iterable):
        raise TaskError(f"{name}.objects lists objects: (Object(...),), not {short(task.objects)}")
    _check_query(f"{name}.query", task.query)
    _check_query(f"{name}.reward_query", task.reward_query)


def _check_query(where: str, query: Any) -> None:
    if not isinstance(query, StateQuery):
        raise TaskError(f"{where} is a StateQuery(...), not {query!r}")
    for each in query.links:
        if not isinstance(each, LinkQuery):
            raise TaskError(f'{where}: links lists LinkQuery("NAME"), not {each!r}')
    for what in ("models", "contacts_of", "sensors"):
        names = getattr(query, what)
        if isinstance(names, str):
            raise TaskError(f"{where}: {what} lists names: ({names!r},), and not {names!r}")


def checked_steps(most: Any) -> int | None:
    """Returns after how many steps episodes are truncated, or None; raises TaskError for anything else."""
    if most is not None and (not isinstance(most, (int, np.integer)) or most < 1):
        raise TaskError(f"max_steps must be at least 1, and a whole number, not {most!r}")
    return None if most is None else int(most)


def made_space(task: Task, method: str, kind: type = gymnasium.Space) -> Any:
    """Returns a space that a method makes, or an attribute is; raises TaskError unless it is of that kind."""
    made = getattr(task, method)
    return checked(task, method, made() if callable(made) else made, kind)


def checked(task: Task, method: str, given: Any, kind: type | tuple[type, ...]) -> Any:
    """Returns what a method has returned; raises TaskError unless it is of that type, or one of them."""
    if not isinstance(given, kind):
        raise _wrong(task, method, given, WANTED[kind])
    return given


def checked_number(task: Task, method: str, given: Any) -> float:
    """Returns the finite number that a method has returned; raises TaskError for anything else."""
    try:
        number = float(given)
    except (TypeError, ValueError):
        number = math.nan
    if not math.isfinite(number):
        raise _wrong(task, method, given, "a finite number")
    return number


def short(given: Any) -> str:
    """Returns Python's representation, cut to a line or two."""
    return textwrap.shorten(repr(given), 160, placeholder=" ...")


def _wrong(task: Task, method: str, given: Any, wanted: str) -> TaskError:
    return TaskError(f"{type(task).__name__}.{method}() returned {short(given)}; it must be {wanted}")


def goal_space(task: GoalTask, observations: gymnasium.Space[Any]) -> gymnasium.spaces.Dict:
    """Returns the observation space of a goal environment; raises TaskError unless the goals are a Box."""
    achieved, desired = (made_space(task, "goals", gymnasium.spaces.Box) for _ in range(2))
    return gymnasium.spaces.Dict(
        {"observation": observations, "achieved_goal": achieved, "desired_goal": desired}
    )


def set_goal(task: GoalTask, state: WorldState, rng: np.random.Generator, goal: Any = None) -> None:
    """Gives a task an episode's goal: `goal`, or the one that it draws; raises TaskError for a wrong one.

    A goal is always drawn, so that later draws don't depend on `goal`.
    """
    drawn = task.goal(rng, state)
    task.desired = checked_goal(task, drawn if goal is None else goal)


def checked_goal(task: GoalTask, given: Any) -> np.ndarray:
    """Returns a goal in the form of the task's space of goals; raises TaskError if it isn't in it."""
    space = task.goals()
    goal = _array(given, space.dtype)
    if not space.contains(goal):
        raise TaskError(f"the goal {given} isn't one of {type(task).__name__}'s goals: {space}")
    return goal


def with_goals(task: GoalTask, observation: Any, state: WorldState) -> dict[str, Any]:
    """Returns a goal environment's observation; raises TaskError for `achieved` of a wrong shape or NaN."""
    given, desired = task.achieved(state), task.desired
    achieved = _array(given, desired.dtype)
    if achieved.shape != desired.shape or not math.isfinite(achieved.sum()):
        raise _wrong(task, "achieved", given, f"finite numbers of the shape {desired.shape}")
    return {"observation": observation, "achieved_goal": achieved, "desired_goal": desired.copy()}


def _array(given: Any, dtype: Any) -> np.ndarray:
    """Returns NaN for what holds no numbers."""
    try:
        return np.asarray(given, dtype)
    except (TypeError, ValueError):
        return np.array(math.nan)
