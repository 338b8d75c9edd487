"""Gymnasium's environments by id, in the form that an agent wants, with errors that help."""

import os
from collections.abc import Mapping
from typing import Any, TypeGuard

import gymnasium
import numpy as np
from gymnasium import spaces

from rl_workbench.errors import WorkbenchError
from rl_workbench.extras import installing
from rl_workbench.training.environments.checked import (
    CheckedEnvironment,
    EnvironmentFailure,
    told,
)
from rl_workbench.training.environments.names import import_module_of, unknown_environment

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
