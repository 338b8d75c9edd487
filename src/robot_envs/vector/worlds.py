"""Many environments stepped one after the other, in memory that can be shared between processes."""

from collections.abc import Sequence
from typing import Any, NamedTuple, SupportsFloat

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode

Env = gymnasium.Env[Any, Any]
Infos = list[tuple[int, dict[str, Any]]]
"""What environments tell beside their results: the environment's index, and what it tells."""


class Arrays(NamedTuple):
    """What goes in and out of n environments; each begins at a multiple of eight bytes."""

    actions: np.ndarray  # (n, ...)
    observations: np.ndarray  # (n, ...)
    rewards: np.ndarray  # (n,)
    terminations: np.ndarray  # (n,)
    truncations: np.ndarray  # (n,)

    def part(self, begin: int, end: int) -> "Arrays":
        """A view of the environments from `begin` to before `end`."""
        return Arrays(*(array[begin:end] for array in self))


def _shapes(env: Env, count: int) -> list[tuple[tuple[int, ...], Any]]:
    action, observation = env.action_space, env.observation_space
    flags = ((count,), np.bool_)
    return [
        ((count, *(action.shape or ())), action.dtype),
        ((count, *(observation.shape or ())), observation.dtype),
        ((count,), np.float64),
        flags,
        flags,
    ]


def _sizes(env: Env, count: int) -> list[int]:
    """Of the arrays [bytes], rounded up to eight."""
    return [
        -(-int(np.prod(shape)) * np.dtype(kind).itemsize // 8) * 8
        for shape, kind in _shapes(env, count)
    ]


def bytes_needed(env: Env, count: int) -> int:
    """Memory for `count` environments like this one."""
    return sum(_sizes(env, count))


def arrays_in(memory: Any, env: Env, count: int) -> Arrays:
    """Lays the arrays of `count` environments like this one into a writable buffer."""
    found, place = [], 0
    for (shape, kind), size in zip(_shapes(env, count), _sizes(env, count), strict=True):
        found.append(np.ndarray(shape, kind, memory, place))
        place += size
    return Arrays(*found)


class Worlds:
    """Some of a vector environment's environments, and their part of the arrays.

    Args:
        envs: the environments.
        arrays: as many rows; actions are read from them, results written to them.
        first: index of the first one among all.
        mode: what becomes of an environment whose episode has ended.
    """

    def __init__(
        self, envs: Sequence[Env], arrays: Arrays, first: int, mode: AutoresetMode
    ) -> None:
        self._envs = envs
        self._arrays = arrays
        self._first = first
        self._mode = mode
        self._ended = [False] * len(envs)

    def reset(
        self,
        seeds: Sequence[int | None],
        options: dict[str, Any] | None,
        mask: Sequence[bool] | None,
    ) -> Infos:
        """Starts an episode in each environment, or in those that the mask names."""
        infos: Infos = []
        for index, env in enumerate(self._envs):
            if mask is None or mask[index]:
                self._begin(index, env, infos, seed=seeds[index], options=options)
                self._arrays.terminations[index] = self._arrays.truncations[index] = False
                self._ended[index] = False
        return infos

    def _begin(self, index: int, env: Env, infos: Infos, **how: Any) -> None:
        self._arrays.observations[index], info = env.reset(**how)
        if info:
            infos.append((self._first + index, info))

    def step(self) -> Infos:
        """Carries out one action in each; the first step after an episode's end starts a new one."""
        infos: Infos = []
        actions = self._arrays.actions.tolist()  # plain numbers: quicker, and just as exact
        for index, env in enumerate(self._envs):
            if self._ended[index] and self._mode is AutoresetMode.NEXT_STEP:
                self._begin(index, env, infos)
                self._put(index, 0.0, False, False)
            else:
                self._step_one(index, env, actions[index], infos)
        return infos

    def _step_one(self, index: int, env: Env, action: Any, infos: Infos) -> None:
        observation, reward, terminated, truncated, info = env.step(action)
        self._put(index, reward, terminated, truncated)
        if self._ended[index] and self._mode is AutoresetMode.SAME_STEP:
            final = {"final_obs": observation, "final_info": info}
            infos.append((self._first + index, final))
            self._begin(index, env, infos)
            return
        self._arrays.observations[index] = observation
        if info:
            infos.append((self._first + index, info))

    def _put(self, index: int, reward: SupportsFloat, terminated: bool, truncated: bool) -> None:
        arrays = self._arrays
        arrays.rewards[index] = reward
        arrays.terminations[index] = terminated
        arrays.truncations[index] = truncated
        self._ended[index] = terminated or truncated

    def call(self, name: str, arguments: Sequence[Any]) -> list[Any]:
        """What the environments' attribute `name` is, or gives when called."""
        found = [getattr(env, name) for env in self._envs]
        return [value(*arguments) if callable(value) else value for value in found]

    def close(self) -> None:
        """Closes all of them."""
        for env in self._envs:
            env.close()


def check_resettable(env: gymnasium.vector.VectorEnv, mask: Any) -> list[bool]:
    """Returns a reset mask as Gymnasium defines it, as plain flags.

    Raises:
        ValueError: if it isn't an array of `num_envs` flags, at least one of them set.
    """
    if not isinstance(mask, np.ndarray) or mask.shape != (env.num_envs,) or mask.dtype != np.bool_:
        raise ValueError(f"reset_mask must be an array of {env.num_envs} bool, not {mask!r}")
    if not mask.any():
        raise ValueError("reset_mask names no environment")
    return [bool(flag) for flag in mask]
