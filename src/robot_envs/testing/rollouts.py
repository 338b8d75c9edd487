"""Rollouts of an environment under test, and their differences."""

import contextlib
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import gymnasium
import numpy as np

from robot_envs.environment import RobotEnv

Make = Callable[..., gymnasium.Env[Any, Any]]


@dataclass(frozen=True)
class Subject:
    """An environment under test."""

    make: Make  # makes one, from options
    options: dict[str, Any] = field(default_factory=dict)  # that it is made with
    identifier: str | None = None  # Gymnasium's; None: it has none
    steps: int = 100  # of a rollout
    backend: str | None = None  # by name

    @contextlib.contextmanager
    def made(self, **options: Any) -> Iterator[RobotEnv]:
        """Makes one without wrappers, and closes it in the end."""
        backend = {} if self.backend is None else {"backend": self.backend}
        env = self.make(**{**self.options, **backend, **options}).unwrapped
        try:
            assert isinstance(env, RobotEnv), f"it is {env!r}, and no robot_envs.RobotEnv"
            yield env
        finally:
            env.close()

    def over(self, backend: str | None) -> "Subject":
        """Returns the same over another backend."""
        return replace(self, backend=backend)


def expect_error(call: Callable[[], Any], what: str, *kinds: type[Exception]) -> None:
    """Raises AssertionError, which says `what`, unless a call raises an error of some kinds."""
    wanted = " or ".join(kind.__name__ for kind in kinds)
    try:
        call()
    except kinds:
        return
    except Exception as error:
        text = " ".join(str(error).split())
        raise AssertionError(f"{what} raises {type(error).__name__} ({text}), not {wanted}") from error
    raise AssertionError(f"{what} raises nothing, and not {wanted}")


Given = list[tuple[Any, ...]]
"""Results of `reset` and `step`, in order."""

PARTS = {
    2: ("the observation", "the info"),
    5: ("the observation", "the reward", "terminated", "truncated", "the info"),
}


def rollout(env: gymnasium.Env[Any, Any], steps: int, seed: int, two_phases: bool = False) -> Given:
    """Returns the results of seeded random actions, episode after episode, with or without `begin_step`."""
    env.action_space.seed(seed)
    given: Given = [env.reset(seed=seed)]
    for _ in range(steps):
        action = env.action_space.sample()
        if two_phases:
            env.get_wrapper_attr("begin_step")(action)
        given.append(env.step(action))
        if given[-1][2] or given[-1][3]:
            given.append(env.reset())
    return given


def differences(one: Given, other: Given) -> str:
    """Returns the first difference of two rollouts, in words; empty if they are bit-identical."""
    for at, (first, second) in enumerate(zip(one, other, strict=False)):
        steps = sum(len(each) == 5 for each in one[: at + 1])
        when = f"step {steps}" if len(first) == 5 else f"the reset after {steps} steps"
        if len(first) != len(second):
            return f"{when}: an episode has ended in one of them only"
        for part, mine, theirs in zip(PARTS[len(first)], first, second, strict=True):
            if not same(mine, theirs):
                return f"{when}: {part} is {mine!r} and {theirs!r}"
    return "" if len(one) == len(other) else "one of them is longer"


def same(one: Any, other: Any) -> bool:
    """Returns whether two values are bit-identical: arrays, numbers, and containers of them."""
    if type(one) is not type(other):
        return False
    if isinstance(one, np.ndarray):
        fits = one.dtype == other.dtype and one.shape == other.shape
        return fits and (
            one.tolist() == other.tolist() if one.dtype == object else one.tobytes() == other.tobytes()
        )
    if isinstance(one, Mapping):
        return one.keys() == other.keys() and all(same(one[key], other[key]) for key in one)
    if isinstance(one, Sequence) and not isinstance(one, (str, bytes)):
        return len(one) == len(other) and all(map(same, one, other))
    return bool(one == other) or (isinstance(one, float) and math.isnan(one) and math.isnan(other))


def outside(space: gymnasium.Space[Any], value: Any) -> str:
    """Returns why a value isn't in a space, in words; empty if it is."""
    if space.contains(value):
        return ""
    if isinstance(space, gymnasium.spaces.Dict) and isinstance(value, Mapping):
        if value.keys() != space.keys():
            return f"it has {', '.join(value)}, and the space {', '.join(space.keys())}"
        reasons = ((key, outside(part, value[key])) for key, part in space.items())
        return next(f"{key}: {why}" for key, why in reasons if why)
    if not isinstance(space, gymnasium.spaces.Box) or not isinstance(value, np.ndarray):
        return f"{value!r} isn't of {space}"
    if value.shape != space.shape or not np.can_cast(value.dtype, space.dtype):
        return f"it is {value.dtype} of the shape {value.shape}, and not of {space}"
    wrong = ~((space.low <= value) & (value <= space.high))
    place = tuple(np.argwhere(wrong)[0].tolist())
    low, high = space.low[place], space.high[place]
    return f"entry {place[0] if len(place) == 1 else place} is {value[place]}, and not in [{low}, {high}]"


def numbers(value: Any) -> Iterator[np.ndarray]:
    """Yields all arrays in a value."""
    if isinstance(value, Mapping):
        value = list(value.values())
    if isinstance(value, (list, tuple)):
        for each in value:
            yield from numbers(each)
    elif isinstance(value, (np.ndarray, np.generic, float, int)):
        yield np.asarray(value)
