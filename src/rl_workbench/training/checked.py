"""What an environment gives, checked before it spoils what is learned from it."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces

from rl_workbench.errors import EnvironmentFailure, WorkbenchError, error_line

LARGEST = float(np.finfo(np.float32).max)  # networks and replay know no larger number
COMPUTE_REWARD = "compute_reward"  # method of an environment with a goal
BEGIN_STEP = "begin_step"  # and of one whose step takes time elsewhere, as in a simulator


class CheckedEnvironment(gymnasium.Wrapper[Any, Any, Any, Any]):
    """Ends with one line what would spoil replay, statistics and weights, before it gets there.

    Args:
        env: its observations are vectors, or a Dict of arrays.
        env_id: for the error.
    """

    def __init__(self, env: gymnasium.Env[Any, Any], env_id: str) -> None:
        super().__init__(env)
        self._id, self._begin_step = env_id, _beginning(env)

    def begin_step(self, action: Any) -> None:
        """Has a step begin, where the environment can: the next `step`, by the same action, takes its answer.

        Raises:
            WorkbenchError: if the environment fails.
        """
        with self._running("begin_step"):
            self._begin_step(action)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """As the environment's.

        Raises:
            WorkbenchError: if the observation isn't finite in single precision, or the environment
                fails.
        """
        with self._running("reset"):
            observation, info = self.env.reset(seed=seed, options=options)
        self._check(observation)
        return observation, info

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """As the environment's.

        Raises:
            WorkbenchError: if the observation or the reward isn't finite in single precision, or the
                environment fails.
        """
        with self._running("step"):
            observation, reward, terminated, truncated, info = self.env.step(action)
        self._check(observation)
        try:
            size = abs(float(reward))
        except (TypeError, ValueError) as error:
            raise WorkbenchError(f"the reward of {self._id} isn't a number: {reward!r}") from error
        if not size <= LARGEST:  # so that NaN is refused too
            raise self._error("reward", reward)
        return observation, reward, terminated, truncated, info

    @property
    def can_compute_reward(self) -> bool:
        """Whether it has rewards for goals that it is given."""
        return self.env.has_wrapper_attr(COMPUTE_REWARD)

    def compute_reward(self, achieved: np.ndarray, desired: np.ndarray, info: Any) -> np.ndarray:
        """The rewards for goals that were achieved while others were desired, as hindsight asks for them.

        Args:
            achieved: goals (N, n).
            desired: goals (N, n).
            info: of each of the steps; a list of N.

        Returns:
            float32, (N,).

        Raises:
            WorkbenchError: if the environment fails, or gives something else.
        """
        with self._running(COMPUTE_REWARD):
            found = self.env.get_wrapper_attr(COMPUTE_REWARD)(achieved, desired, info)
        name = f"{COMPUTE_REWARD}() of {self._id}"
        try:
            rewards = np.asarray(found, np.float32)
        except (TypeError, ValueError) as error:
            raise WorkbenchError(f"{name} gives no numbers: {found!r}") from error
        if rewards.shape != (len(achieved),):
            raise WorkbenchError(
                f"{name} isn't vectorised: for {len(achieved)} goals at once, {achieved.shape}, it gives "
                f"the shape {rewards.shape}, not {(len(achieved),)}; norms take axis=-1"
            )
        if not np.isfinite(rewards).all():
            raise WorkbenchError(f"{name} gives a reward that isn't finite")
        return rewards

    def render(self) -> Any:
        """As the environment's.

        Raises:
            gymnasium.error.Error: as the environment's.
            WorkbenchError: if the environment fails otherwise.
        """
        try:
            return self.env.render()
        except gymnasium.error.Error:  # who draws says what for
            raise
        except (Exception, SystemExit) as error:
            text = f"{self._id} failed in render(): {error_line(error)}"
            raise EnvironmentFailure(text) from error

    def close(self) -> None:
        """As the environment's.

        Raises:
            WorkbenchError: if the environment fails.
        """
        with self._running("close"):
            self.env.close()

    @contextmanager
    def _running(self, method: str) -> Iterator[None]:
        """Whatever it raises ends the training with one line, once what was learned is saved."""
        try:
            yield
        except gymnasium.error.Error as error:  # its text is made for the user
            raise WorkbenchError(str(error) or type(error).__name__) from error
        except (Exception, SystemExit) as error:
            text = f"{self._id} failed in {method}(): {error_line(error)}"
            raise EnvironmentFailure(text) from error

    def _check(self, observation: Any) -> None:
        space = self.observation_space
        if not isinstance(space, spaces.Dict):
            self._check_array("observation", observation, space)
            return
        if not isinstance(observation, dict) or observation.keys() != space.keys():
            keys = list(observation) if isinstance(observation, dict) else observation
            raise WorkbenchError(
                f"the observation of {self._id} has {' '.join(str(keys).split())}, its "
                f"observation_space {list(space)}"
            )
        for name, part in space.items():
            self._check_array(name, observation[name], part)

    def _check_array(self, name: str, array: Any, space: gymnasium.Space[Any]) -> None:
        try:
            is_finite = np.abs(array).max(initial=0) <= LARGEST
        except (TypeError, ValueError) as error:
            what = f"the {name} of {self._id} isn't a vector of numbers"
            raise WorkbenchError(f"{what}: {' '.join(repr(array).split())}") from error
        if np.shape(array) != space.shape:
            raise WorkbenchError(
                f"the {name} of {self._id} has the shape {np.shape(array)}, its "
                f"observation_space {space.shape}"
            )
        if not is_finite:
            raise self._error(name, array)

    def _error(self, what: str, value: Any) -> WorkbenchError:
        text = " ".join(str(value).split())
        return WorkbenchError(f"the {what} of {self._id} isn't finite in float32: {text}")


def _beginning(env: gymnasium.Env[Any, Any]) -> Callable[[Any], object]:
    """What has a step of an environment begin.

    That does nothing where the environment can't, as one in this process, or where a wrapper lies between
    that may have its steps taken by other actions.
    """
    layer: Any = env
    while isinstance(layer, gymnasium.Wrapper):
        is_known = type(layer).__module__.startswith("gymnasium.")
        if isinstance(layer, gymnasium.ActionWrapper) or not is_known:
            return lambda action: None
        layer = layer.env
    begin: Callable[[Any], object] = getattr(layer, BEGIN_STEP, lambda action: None)
    return begin
