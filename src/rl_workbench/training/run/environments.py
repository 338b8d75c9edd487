"""Gymnasium's environments by id, in the form that an agent wants, with errors that help."""

import os
from collections.abc import Mapping
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces

from rl_workbench.errors import WorkbenchError
from rl_workbench.extras import installing
from rl_workbench.training.options.options import unknown

FLAT = (spaces.Box, spaces.Discrete, spaces.MultiBinary, spaces.MultiDiscrete)
CONTINUOUS = "PPO, A2C, SAC, TD3 or DDPG"
SEVERAL = "PPO or A2C"
LARGEST = float(np.finfo(np.float32).max)  # networks and replay know no larger number
# What constructors raise about options that they don't like.
_REFUSED = (gymnasium.error.Error, ImportError, TypeError, ValueError, LookupError, AssertionError)
# What running ones raise that can't go on: Gymnasium's own, and those of devices and connections, which
# the frame would take for its disk's.
_FAILED = (gymnasium.error.Error, OSError)


def make_environment(
    env_id: str, options: Mapping[str, Any] | None = None
) -> gymnasium.Env[Any, Any]:
    """Makes an environment; its observations are vectors, flattened where they weren't.

    It refuses to go on with an observation or a reward that isn't finite.

    Raises:
        WorkbenchError: if there is no such environment, naming the nearest, if something that it
            needs isn't installed, or if its options make no sense.
    """
    try:
        env: gymnasium.Env[Any, Any] = gymnasium.make(env_id, **(options or {}))
    except gymnasium.error.DependencyNotInstalled as error:
        workspace = os.environ.get(
            "CARTPOLE_WS"
        )  # elsewhere Gymnasium's own text names the command
        hint = f" ({installing(env_id)} may install them)" if workspace else ""
        raise WorkbenchError(f"{env_id} needs more packages{hint}: {error}") from error
    except (gymnasium.error.UnregisteredEnv, gymnasium.error.DeprecatedEnv) as error:
        known = sorted(gymnasium.registry)
        raise WorkbenchError(_nearest(env_id, known)) from error
    except _REFUSED as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise WorkbenchError(f"can't make {env_id}: {reason}") from error
    return CheckedEnvironment(_flat(env, env_id), env_id)


class CheckedEnvironment(gymnasium.Wrapper[Any, Any, Any, Any]):
    """Ends with one line what would spoil replay, statistics and weights, before it gets there.

    Args:
        env: its observations are vectors.
        env_id: for the error.
    """

    def __init__(self, env: gymnasium.Env[Any, Any], env_id: str) -> None:
        super().__init__(env)
        self._id = env_id

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """As the environment's.

        Raises:
            WorkbenchError: if the observation isn't finite in single precision, or the environment
                fails as Gymnasium's do.
        """
        try:
            observation, info = self.env.reset(seed=seed, options=options)
        except _FAILED as error:
            raise self._failed(error) from error
        self._check(observation)
        return observation, info

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """As the environment's.

        Raises:
            WorkbenchError: if the observation or the reward isn't finite in single precision, or the
                environment fails as Gymnasium's do.
        """
        try:
            observation, reward, terminated, truncated, info = self.env.step(action)
        except _FAILED as error:
            raise self._failed(error) from error
        self._check(observation)
        try:
            size = abs(float(reward))
        except (TypeError, ValueError) as error:
            raise WorkbenchError(f"the reward of {self._id} isn't a number: {reward!r}") from error
        if not size <= LARGEST:  # so that NaN is refused too
            raise self._error("reward", reward)
        return observation, reward, terminated, truncated, info

    def _failed(self, error: Exception) -> WorkbenchError:
        text = str(error) or type(error).__name__
        return WorkbenchError(f"{self._id} failed: {text}" if isinstance(error, OSError) else text)

    def _check(self, observation: np.ndarray) -> None:
        if not np.abs(observation).max(initial=0) <= LARGEST:
            raise self._error("observation", observation)

    def _error(self, what: str, value: Any) -> WorkbenchError:
        text = " ".join(str(value).split())
        return WorkbenchError(f"the {what} of {self._id} isn't finite in float32: {text}")


def shares_robot(env: gymnasium.Env[Any, Any]) -> bool:
    """Whether another environment of this kind would move the same robot."""
    return bool(getattr(env.unwrapped, "shares_robot", False))


def _nearest(env_id: str, known: list[str]) -> str:
    text = unknown("environment", env_id, known)
    return text if "did you mean" in text else f"unknown environment {env_id!r}"


def _flat(env: gymnasium.Env[Any, Any], env_id: str) -> gymnasium.Env[Any, Any]:
    space = env.observation_space
    if isinstance(space, spaces.Box) and len(space.shape) == 1:
        return env
    if isinstance(space, FLAT):
        return gymnasium.wrappers.FlattenObservation(env)
    env.close()
    raise WorkbenchError(f"{env_id} observes {space}; only vectors of numbers can be learned from")


def discrete_actions(env: gymnasium.Env[Any, Any], env_id: str, algorithm: str) -> int:
    """The number of actions.

    Raises:
        WorkbenchError: if the actions aren't the numbers from 0 on; says what fits them.
    """
    space = env.action_space
    if isinstance(space, spaces.Discrete) and space.start == 0:
        return int(space.n)
    fits = CONTINUOUS if isinstance(space, spaces.Box) else SEVERAL
    raise WorkbenchError(
        f"{algorithm} needs a choice of single actions, Discrete(n); {env_id} has {space}. "
        f"{fits} fit it (Stable-Baselines3)"
    )
