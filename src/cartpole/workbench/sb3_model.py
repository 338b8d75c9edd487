"""Stable-Baselines3's algorithms made from our settings; what fits which actions."""

from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces

from cartpole.errors import CartpoleError
from cartpole.training.environments import make_environment
from cartpole.workbench.sb3_settings import (
    CLASSES,
    NETWORK,
    ON_POLICY,
    SB3Choice,
    algorithm_class,
)

FITS = {
    "sac": (spaces.Box,),
    "td3": (spaces.Box,),
    "ddpg": (spaces.Box,),
    "dqn-sb3": (spaces.Discrete,),
    **dict.fromkeys(
        ON_POLICY, (spaces.Box, spaces.Discrete, spaces.MultiDiscrete, spaces.MultiBinary)
    ),
}


def check_fit(algorithm: str, env_id: str, space: gymnasium.Space[Any]) -> None:
    """Refuses an algorithm whose actions aren't the environment's; names those that fit.

    Raises:
        CartpoleError: if it doesn't fit.
    """
    if isinstance(space, FITS[algorithm]):
        return
    fitting = [name for name in CLASSES if isinstance(space, FITS[name])]
    others = [*fitting, *(["dqn_train.py"] if isinstance(space, spaces.Discrete) else [])]
    hint = f"{', '.join(others)} fit it" if others else "none here fits it"
    raise CartpoleError(f"{algorithm} can't choose from {space}, the actions of {env_id}; {hint}")


def make_model(choice: SB3Choice, envs: int | None = None) -> Any:
    """A new model with its environments; the caller closes `model.get_env()`.

    Args:
        envs: how many, if not as many as in training.

    Raises:
        CartpoleError: if the environment can't be made, the algorithm doesn't fit it, or an
            option makes no sense.
    """
    from stable_baselines3.common.vec_env import DummyVecEnv

    run = choice.run
    first = make_environment(run.env_id, run.env_kwargs)
    try:
        check_fit(choice.algorithm, run.env_id, first.action_space)
    finally:
        first.close()
    vector = DummyVecEnv([_maker(choice)] * (envs or run.n_envs))
    try:
        return _make(choice, vector)
    except (TypeError, ValueError, AssertionError, RuntimeError) as error:
        vector.close()
        text = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise CartpoleError(f"{choice.algorithm} can't be made: {text}") from error


def _maker(choice: SB3Choice) -> Callable[[], gymnasium.Env[Any, Any]]:
    from stable_baselines3.common.monitor import Monitor

    run = choice.run
    return lambda: Monitor(make_environment(run.env_id, run.env_kwargs))


def _make(choice: SB3Choice, vector: Any) -> Any:
    own = dict(choice.hyperparameters)
    network = {name: own.pop(name) for name in NETWORK if name in own}
    if choice.run.lr_schedule == "linear":
        own["learning_rate"] = linear(float(own.get("learning_rate", 3e-4)))
    if own.get("action_noise") is not None:
        own["action_noise"] = _noise(own["action_noise"], vector.action_space)
    return algorithm_class(choice.algorithm)(
        "MlpPolicy",
        vector,
        seed=choice.run.seed,
        device=choice.run.device,
        policy_kwargs=network or None,
        **own,
    )


def linear(start: float) -> Callable[[float], float]:
    """A rate that falls to 0 with what remains of the training."""
    return lambda remaining: start * remaining


def _noise(deviation: Any, space: spaces.Box) -> Any:
    """The option action_noise is a standard deviation, of each action alike."""
    from stable_baselines3.common.noise import NormalActionNoise

    if not isinstance(deviation, int | float):
        raise CartpoleError(f"action_noise is a standard deviation, a number, not {deviation!r}")
    return NormalActionNoise(np.zeros(space.shape), np.full(space.shape, float(deviation)))


def greedy(model: Any) -> Callable[[np.ndarray], Any]:
    """The model as a function of one observation (D,)."""

    def act(observation: np.ndarray) -> Any:
        return model.policy.predict(observation, deterministic=True)[0]

    return act
