"""Gymnasium's environments by id, in the form that an agent wants, with errors that help."""

import os
import sysconfig
import traceback
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces

from rl_workbench.errors import WorkbenchError
from rl_workbench.extras import finding_modules, installing
from rl_workbench.training.options.options import unknown

FLAT = (spaces.Box, spaces.Discrete, spaces.MultiBinary, spaces.MultiDiscrete)
CONTINUOUS = "PPO, A2C, SAC, TD3 or DDPG"
SEVERAL = "PPO or A2C"
LARGEST = float(np.finfo(np.float32).max)  # networks and replay know no larger number
# What constructors raise about options that they don't like.
_REFUSED = (gymnasium.error.Error, ImportError, TypeError, ValueError, LookupError, AssertionError)


# Where code isn't the user's.
_LIBRARIES = (
    *(sysconfig.get_path(name) for name in ("stdlib", "purelib", "platlib")),
    str(Path(__file__).resolve().parents[2]),
    str(Path(gymnasium.__file__).parent),
    "<frozen",
)


class EnvironmentFailure(WorkbenchError):
    """An environment's own code has failed; the text names the place, the cause has the traceback."""


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
        module, colon, _ = env_id.partition(":")
        if colon and isinstance(error.__cause__ or error, ModuleNotFoundError):
            missing = getattr(error.__cause__ or error, "name", None)
            if missing and f"{module}.".startswith(f"{missing}."):  # not one that it imports itself
                text = f"can't make {env_id}: there is no module '{missing}'; {finding_modules()}"
                raise WorkbenchError(text) from error
        reason = " ".join(str(error).split()) or type(error).__name__
        raise WorkbenchError(f"can't make {env_id}: {reason}") from error
    except (Exception, SystemExit) as error:
        raise EnvironmentFailure(f"can't make {env_id}: {_told(error)}") from error
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
            text = f"{self._id} failed in render(): {_told(error)}"
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
            text = f"{self._id} failed in {method}(): {_told(error)}"
            raise EnvironmentFailure(text) from error

    def _check(self, observation: np.ndarray) -> None:
        shape = self.observation_space.shape
        try:
            is_finite = np.abs(observation).max(initial=0) <= LARGEST
        except (TypeError, ValueError) as error:
            what = f"the observation of {self._id} isn't a vector of numbers"
            raise WorkbenchError(f"{what}: {' '.join(repr(observation).split())}") from error
        if np.shape(observation) != shape:
            raise WorkbenchError(
                f"the observation of {self._id} has the shape {np.shape(observation)}, its "
                f"observation_space {shape}"
            )
        if not is_finite:
            raise self._error("observation", observation)

    def _error(self, what: str, value: Any) -> WorkbenchError:
        text = " ".join(str(value).split())
        return WorkbenchError(f"the {what} of {self._id} isn't finite in float32: {text}")


def _told(error: BaseException) -> str:
    """An error in one line, with the place in the user's own code, if it went through that."""
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame for frame in frames if not frame.filename.startswith(_LIBRARIES)]
    place = (own or frames)[-1]
    text = " ".join(str(error).split())
    return f"{type(error).__name__}{': ' if text else ''}{text} ({place.filename}:{place.lineno})"


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
