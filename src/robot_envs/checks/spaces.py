"""Actions and observations, checked against their spaces: one line says what doesn't fit, and of whom."""

import math
import operator
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np

from robot_envs.errors import TaskError

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
