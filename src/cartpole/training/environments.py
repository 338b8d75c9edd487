"""Gymnasium's environments by id, in the form that an agent wants, with errors that help."""

from collections.abc import Mapping
from typing import Any

import gymnasium
from gymnasium import spaces

from cartpole.errors import CartpoleError
from cartpole.training.options import unknown

FLAT = (spaces.Box, spaces.Discrete, spaces.MultiBinary, spaces.MultiDiscrete)
CONTINUOUS = "PPO, A2C, SAC, TD3 or DDPG"
SEVERAL = "PPO or A2C"


def make_environment(
    env_id: str, options: Mapping[str, Any] | None = None
) -> gymnasium.Env[Any, Any]:
    """Makes an environment; its observations are vectors, flattened where they weren't.

    Raises:
        CartpoleError: if there is no such environment, naming the nearest, if something that it
            needs isn't installed, or if its options make no sense.
    """
    try:
        env: gymnasium.Env[Any, Any] = gymnasium.make(env_id, **(options or {}))
    except gymnasium.error.DependencyNotInstalled as error:
        raise CartpoleError(f"{env_id} needs more packages, see ./ws extras: {error}") from error
    except (gymnasium.error.UnregisteredEnv, gymnasium.error.DeprecatedEnv) as error:
        known = sorted(gymnasium.registry)
        raise CartpoleError(_nearest(env_id, known)) from error
    except (gymnasium.error.Error, ImportError, TypeError, ValueError) as error:
        raise CartpoleError(f"can't make {env_id}: {error}") from error
    return _flat(env, env_id)


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
    raise CartpoleError(f"{env_id} observes {space}; only vectors of numbers can be learned from")


def discrete_actions(env: gymnasium.Env[Any, Any], env_id: str, algorithm: str) -> int:
    """The number of actions.

    Raises:
        CartpoleError: if the actions aren't the numbers from 0 on; says what fits them.
    """
    space = env.action_space
    if isinstance(space, spaces.Discrete) and space.start == 0:
        return int(space.n)
    fits = CONTINUOUS if isinstance(space, spaces.Box) else SEVERAL
    raise CartpoleError(
        f"{algorithm} needs a choice of single actions, Discrete(n); {env_id} has {space}. "
        f"{fits} fit it (Stable-Baselines3)"
    )
