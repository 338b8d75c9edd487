"""Gymnasium's environments by id, in the form that an agent wants, with errors that help."""

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, nullcontext
from typing import Any, TypeGuard

import gymnasium
import numpy as np
from gymnasium import spaces

from rl_workbench.env_ids import import_module_of, unknown_environment
from rl_workbench.errors import WorkbenchError, installing
from rl_workbench.training.checked import (
    CheckedEnvironment,
    EnvironmentFailure,
    told,
)

FLAT = (spaces.Box, spaces.Discrete, spaces.MultiBinary, spaces.MultiDiscrete)
CONTINUOUS = "reinforce, or Stable-Baselines3's ppo, a2c, sac, td3 or ddpg"
SEVERAL = "Stable-Baselines3's ppo or a2c"
SHARED = "shares_robot"  # attribute of an environment whose copies would move the same robot
# What constructors raise about options that they don't like.
_REFUSED = (gymnasium.error.Error, ImportError, TypeError, ValueError, LookupError, AssertionError)


def make_environment(
    env_id: str, options: Mapping[str, Any] | None = None, *, keep_dict: bool = False
) -> CheckedEnvironment:
    """Makes an environment; its observations are vectors, flattened where they weren't.

    It refuses to go on with an observation or a reward that isn't finite.

    Args:
        env_id: Gymnasium's, also as module:id.
        options: of the environment.
        keep_dict: leave a Dict of arrays as it is, as for a goal.

    Raises:
        WorkbenchError: if there is no such environment, naming the nearest, if something that it
            needs isn't installed, or if its options make no sense.
    """
    import_module_of(env_id)
    try:
        env: gymnasium.Env[Any, Any] = gymnasium.make(env_id, **(options or {}))
    except gymnasium.error.DependencyNotInstalled as error:
        workspace = os.environ.get(
            "CARTPOLE_WS"
        )  # elsewhere Gymnasium's own text names the command
        hint = f" ({installing(env_id)} may install them)" if workspace else ""
        raise WorkbenchError(f"{env_id} needs more packages{hint}: {error}") from error
    except (gymnasium.error.UnregisteredEnv, gymnasium.error.DeprecatedEnv) as error:
        raise WorkbenchError(unknown_environment(env_id)) from error
    except _REFUSED as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise WorkbenchError(f"can't make {env_id}: {reason}") from error
    except (Exception, SystemExit) as error:
        raise EnvironmentFailure(f"can't make {env_id}: {told(error)}") from error
    if keep_dict and is_dict_of_arrays(env.observation_space):
        return CheckedEnvironment(env, env_id)
    return CheckedEnvironment(_flat(env, env_id), env_id)


def is_dict_of_arrays(space: gymnasium.Space[Any]) -> bool:
    """Whether it is a Dict of Boxes, as that of an environment with a goal."""
    return isinstance(space, spaces.Dict) and all(
        isinstance(part, spaces.Box) for part in space.values()
    )


def has_goal(space: gymnasium.Space[Any]) -> bool:
    """Whether observations tell a goal, in Gymnasium-Robotics' form."""
    goal = {"observation", "achieved_goal", "desired_goal"}
    return isinstance(space, spaces.Dict) and goal <= space.keys()


def _flat(env: gymnasium.Env[Any, Any], env_id: str) -> gymnasium.Env[Any, Any]:
    space = env.observation_space
    if isinstance(space, spaces.Box) and len(space.shape) == 1:
        return env
    if _is_numbers(space):
        return gymnasium.wrappers.FlattenObservation(env)
    env.close()
    raise WorkbenchError(f"{env_id} observes {space}; only vectors of numbers can be learned from")


def _is_numbers(space: gymnasium.Space[Any]) -> bool:
    if isinstance(space, spaces.Dict | spaces.Tuple):
        parts = space.values() if isinstance(space, spaces.Dict) else space
        return all(map(_is_numbers, parts))
    return isinstance(space, FLAT)


def shares_robot(env: gymnasium.Env[Any, Any]) -> bool:
    """Whether another environment of this kind would move the same robot."""
    return env.has_wrapper_attr(SHARED) and bool(env.get_wrapper_attr(SHARED))


def is_continuous(space: gymnasium.Space[Any]) -> TypeGuard[spaces.Box]:
    """Whether actions are arrays of real numbers."""
    return isinstance(space, spaces.Box) and np.issubdtype(space.dtype, np.floating)


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
        f"--algo {fits}: these fit it"
    )


SUCCESS = "is_success"  # of an episode, in the info of its last step


def as_float32(observation: Any) -> Any:
    """An observation as networks take it: an array, or a dict of arrays."""
    if isinstance(observation, dict):
        return {name: np.asarray(part, np.float32) for name, part in observation.items()}
    return np.asarray(observation, np.float32)


def as_vector(observation: Any) -> np.ndarray:
    """All numbers of an observation, (D,), float32.

    A copy: an environment may well write into the array that it returned.
    """
    if isinstance(observation, dict):
        return np.concatenate([np.ravel(part) for part in observation.values()], dtype=np.float32)
    return np.array(observation, dtype=np.float32)


def succeeded(info: Mapping[str, Any]) -> bool | None:
    """Whether the episode that ends with this info has succeeded; None if its environment doesn't say."""
    value = info.get(SUCCESS)
    return None if value is None else bool(np.all(value))


# Attribute of an environment that shares its robot: the options by which a copy has one of its own.
OWN_ROBOT = "own_robot_options"
# And its method: side_by_side(count) is a context manager within which that many start, or end, at once.
SIDE_BY_SIDE = "side_by_side"


class NumberedEnvironment(gymnasium.Wrapper[Any, Any, Any, Any]):
    """One of several: what fails in it is told with its number.

    Args:
        env: the environment.
        index: from 0 on.
        count: of all of them.
    """

    env: CheckedEnvironment

    def __init__(self, env: CheckedEnvironment, index: int, count: int) -> None:
        super().__init__(env)
        self._index, self._count = index, count

    def begin_step(self, action: Any) -> None:
        """As the environment's."""
        with numbered(self._index, self._count):
            self.env.begin_step(action)

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """As the environment's."""
        with numbered(self._index, self._count):
            return self.env.step(action)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """As the environment's."""
        with numbered(self._index, self._count):
            return self.env.reset(seed=seed, options=options)

    def close(self) -> None:
        """As the environment's."""
        with numbered(self._index, self._count):
            self.env.close()


def make_several(
    make: Callable[[Mapping[str, Any]], CheckedEnvironment],
    given: Mapping[str, Any],
    env_id: str,
    count: int,
) -> list[gymnasium.Env[Any, Any]]:
    """Makes environments of which each moves a robot of its own; the caller closes them, by `close_all`.

    Args:
        make: makes one by its options.
        given: these options. Where copies of such an environment would move the same robot it says itself
            what they need beside them to have one of their own.
        env_id: for the error.
        count: of environments; a single one is as `given` says.

    Raises:
        WorkbenchError: if they can't be made, or there is but one robot.
    """
    first = make(given)
    if count == 1:
        return [first]
    made = [first]
    with ExitStack() as making:
        making.callback(close_all, made)
        if apart := own_robot(first, env_id, f"num_envs is 1, not {count}"):
            made.pop().close()
            given = {**given, **apart}
        with _side_by_side(first, count - len(made)):
            for index in range(len(made), count):
                with numbered(index, count):
                    made.append(make(given))
        making.pop_all()
    return [NumberedEnvironment(env, index, count) for index, env in enumerate(made)]


def close_all(envs: Sequence[gymnasium.Env[Any, Any]]) -> None:
    """Closes environments, all of them also where one fails.

    Raises:
        WorkbenchError: if one fails.
    """
    if not envs:
        return
    with _side_by_side(envs[0], len(envs)), ExitStack() as closing:
        for env in envs:
            closing.callback(env.close)


@contextmanager
def _side_by_side(env: gymnasium.Env[Any, Any], count: int) -> Iterator[None]:
    """Within it environments like `env` only begin to start, or to end; it waits for them all.

    Where they know nothing of that, they start and end one after the other.
    """
    waiting = _attribute(env, SIDE_BY_SIDE)
    try:
        with waiting(count) if waiting else nullcontext():
            yield
    except gymnasium.error.Error as error:  # its text is made for the user
        raise WorkbenchError(str(error) or type(error).__name__) from error


def _attribute(env: gymnasium.Env[Any, Any], name: str) -> Any:
    """None where it has none."""
    return env.get_wrapper_attr(name) if env.has_wrapper_attr(name) else None


def own_robot(env: gymnasium.Env[Any, Any], env_id: str, otherwise: str) -> dict[str, Any]:
    """The options by which a copy of an environment has a robot of its own; none where it has one anyway.

    Args:
        env: the environment.
        env_id: for the error.
        otherwise: what has to be done where there is but one robot, for the error.

    Raises:
        WorkbenchError: if there is but one robot.
    """
    if not shares_robot(env):
        return {}
    apart = _attribute(env, OWN_ROBOT)
    if not apart:
        raise WorkbenchError(f"{env_id} moves a robot that there is only one of: {otherwise}")
    return dict(apart)


@contextmanager
def numbered(index: int, count: int) -> Iterator[None]:
    """Tells which of several environments fails.

    Raises:
        WorkbenchError: the one that was raised inside, with the number before its text.
    """
    try:
        yield
    except WorkbenchError as error:
        text = f"environment {index + 1} of {count}: {error}"
        raise type(error)(text) from error.__cause__
