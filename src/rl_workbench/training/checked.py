"""Checks of observations and rewards before an agent learns from them."""

import math
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from numbers import Real
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.wrappers import OrderEnforcing, PassiveEnvChecker

from rl_workbench.errors import EnvironmentFailure, WorkbenchError, error_line, own_frames
from rl_workbench.training.progress import warn

Env = gymnasium.Env[Any, Any]
LARGEST_FLOAT32 = float(np.finfo(np.float32).max)  # that networks and replay buffers hold
COMPUTE_REWARD = "compute_reward"  # method of an environment with a goal
BEGIN_STEP = "begin_step"  # method of an environment whose step takes time in another process
SHORT = 32  # numbers of an observation
LONGEST = 10_000  # [steps], of an episode where nothing says how long one lasts

CURVES = "episode_curves"  # in the last info of an episode: the means of its infos' numbers, by tag
_UNFIT = re.compile(r"[^\w./-]+")  # for a tag
# Gymnasium's wrappers and this one unpack what reset (2) and step (5) return.
_OLD_GYM = re.compile(r"unpack \(expected [25]\b|unexpected keyword argument '(seed|options)'")


class CheckedEnvironment(gymnasium.Wrapper[Any, Any, Any, Any]):
    """Turns NaN, wrong shapes and exceptions of an environment into one-line errors.

    All methods raise WorkbenchError if the environment fails; `reset` and `step` also if an observation, a
    vector or a Dict of arrays, or a reward isn't finite in float32. The last info of an episode has the means
    of numbers, see `CURVES`. An environment that declares no `max_episode_steps` is truncated after `LONGEST`
    steps. `which` begins every error, as "environment 2 of 3: ".
    """

    def __init__(self, env: Env, env_id: str, which: str = "") -> None:
        super().__init__(env)
        self._id, self._which, self._begin_step = env_id, which, _begin_method(env)
        self._space = env.observation_space  # a property that asks each wrapper
        self._sums: dict[str, tuple[float, int]] = {}  # and counts, of an episode's info
        # An environment declares a limit to Gymnasium, or as its attribute `max_steps`.
        is_limited = env.has_wrapper_attr("max_steps") and env.get_wrapper_attr("max_steps")
        is_limited = is_limited or (env.spec and env.spec.max_episode_steps)
        self._length, self._longest = 0, math.inf if is_limited else LONGEST  # [steps]
        self._was_cut = False

    def begin_step(self, action: Any) -> None:
        """Begins a step, where the environment can. The next `step`, by the same action, waits for it."""
        with self._running("begin_step"):
            self._begin_step(action)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        with self._running("reset"):
            answer: Any = self.env.reset(seed=seed, options=options)
        if not isinstance(answer, tuple) or len(answer) != 2:
            raise self._old_gym()
        observation, info = answer
        if self._length:  # Gymnasium's checks look at the first steps alone
            self.env = _without_checks(self.env)
        self._sums, self._length = {}, 0
        self._check(observation)
        return observation, info

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        try:
            observation, reward, terminated, truncated, info = self.env.step(action)
            self._length += 1
            if self._length >= self._longest and not (terminated or truncated):
                truncated = True
                if not self._was_cut:
                    self._was_cut = True
                    warn(
                        f"{self._which}{self._id} declares no time limit: episodes are truncated after "
                        f"{LONGEST} steps; its option max_episode_steps=N sets another limit"
                    )
            if info:
                info = self._noted(info, terminated or truncated)
        except (Exception, SystemExit) as error:  # a context manager would take a tenth of a step
            raise self._failure("step", error) from error
        self._check(observation)
        try:
            size = abs(float(reward))
        except (TypeError, ValueError) as error:
            raise self._error(f"the reward of {self._id} isn't a number: {reward!r}") from error
        if not size <= LARGEST_FLOAT32:  # true for NaN, too
            raise self._not_finite("reward", reward)
        return observation, reward, terminated, truncated, info

    def _noted(self, info: dict[str, Any], is_last: bool) -> dict[str, Any]:
        """Adds the numbers of an info to their sums; returns the info, at the end with the means."""
        for name, value in info.items():
            if type(value) is not bool and isinstance(value, Real):
                total, count = self._sums.get(name, (0.0, 0))
                self._sums[name] = total + float(value), count + 1
        if not is_last:
            return info
        means = {f"info/{_UNFIT.sub('_', str(name))}": total / n for name, (total, n) in self._sums.items()}
        return {**info, CURVES: {tag: mean for tag, mean in means.items() if math.isfinite(mean)}}

    def compute_reward(self, achieved: np.ndarray, desired: np.ndarray, info: Any) -> np.ndarray:
        """Returns rewards (N,), float32, for goals (N, n) achieved while others were desired; N infos."""
        with self._running(COMPUTE_REWARD):
            answer = self.env.get_wrapper_attr(COMPUTE_REWARD)(achieved, desired, info)
            rewards = np.asarray(answer, np.float32)
        name = f"{COMPUTE_REWARD}() of {self._id}"
        if rewards.shape != (len(achieved),):
            raise self._error(
                f"{name} isn't vectorised: for {len(achieved)} goals at once, {achieved.shape}, it returns "
                f"the shape {rewards.shape}, not {(len(achieved),)}; norms take axis=-1"
            )
        if not np.isfinite(rewards).all():
            raise self._error(f"{name} returns a reward that isn't finite")
        return rewards

    def render(self) -> Any:
        try:
            return self.env.render()
        except gymnasium.error.Error:  # the caller adds what it draws for
            raise
        except (Exception, SystemExit) as error:
            raise self._failure("render", error) from error

    def close(self) -> None:
        with self._running("close"):
            self.env.close()

    @contextmanager
    def _running(self, method: str) -> Iterator[None]:
        try:
            yield
        except (Exception, SystemExit) as error:
            raise self._failure(method, error) from error

    def _failure(self, method: str, error: BaseException) -> WorkbenchError:
        if isinstance(error, gymnasium.error.Error):  # its text is made for the user
            return self._error(str(error) or type(error).__name__)
        if _OLD_GYM.search(str(error)) and not own_frames(error):
            return self._old_gym()
        return EnvironmentFailure(f"{self._which}{self._id} failed in {method}(): {error_line(error)}")

    def _old_gym(self) -> WorkbenchError:
        return self._error(
            f"{self._id} is written for the old gym: Gymnasium's reset(seed=None, options=None) returns "
            "(observation, info), and its step() (observation, reward, terminated, truncated, info)"
        )

    def _error(self, text: str) -> WorkbenchError:
        return WorkbenchError(f"{self._which}{text}")

    def _check(self, observation: Any) -> None:
        space = self._space
        # NumPy's functions would take a fifth of a short step.
        if (
            type(observation) is np.ndarray
            and observation.shape == space.shape
            and observation.size <= SHORT
            and observation.dtype.kind in "biuf"
            and all([abs(each) <= LARGEST_FLOAT32 for each in observation.ravel().tolist()])  # noqa: C419
        ):
            return
        if not isinstance(space, spaces.Dict):
            self._check_array("observation", observation, space)
            return
        if not isinstance(observation, dict) or observation.keys() != space.keys():
            keys = list(observation) if isinstance(observation, dict) else observation
            raise self._error(
                f"the observation of {self._id} has {' '.join(str(keys).split())}, its "
                f"observation_space {list(space)}"
            )
        for name, part in space.items():
            self._check_array(name, observation[name], part)

    def _check_array(self, name: str, array: Any, space: gymnasium.Space[Any]) -> None:
        try:
            is_finite = np.abs(array).max(initial=0) <= LARGEST_FLOAT32
        except (TypeError, ValueError) as error:
            what = f"the {name} of {self._id} isn't a vector of numbers"
            raise self._error(f"{what}: {' '.join(repr(array).split())}") from error
        if np.shape(array) != space.shape:
            raise self._error(
                f"the {name} of {self._id} has the shape {np.shape(array)}, its "
                f"observation_space {space.shape}"
            )
        if not is_finite:
            raise self._not_finite(name, array)

    def _not_finite(self, what: str, value: Any) -> WorkbenchError:
        text = " ".join(str(value).split())
        return self._error(f"the {what} of {self._id} isn't finite in float32: {text}")


def _without_checks(env: Env) -> Env:
    """Takes Gymnasium's checks out of the wrappers of an environment."""
    if not isinstance(env, gymnasium.Wrapper):
        return env
    env.env = _without_checks(env.env)
    return env.env if isinstance(env, OrderEnforcing | PassiveEnvChecker) else env


def _begin_method(env: Env) -> Callable[[Any], object]:
    """Returns what begins a step; nothing if the environment can't, or a wrapper might change the actions."""
    layer: Any = env
    while isinstance(layer, gymnasium.Wrapper):
        is_known = type(layer).__module__.startswith("gymnasium.")
        if isinstance(layer, gymnasium.ActionWrapper) or not is_known:
            return lambda action: None
        layer = layer.env
    begin: Callable[[Any], object] = getattr(layer, BEGIN_STEP, lambda action: None)
    return begin
