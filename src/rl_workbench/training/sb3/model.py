"""Stable-Baselines3's algorithms made from our settings; what fits which actions."""

from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
import torch
from gymnasium import spaces

from rl_workbench.errors import WorkbenchError
from rl_workbench.training.run.environments import make_environment
from rl_workbench.training.sb3.settings import (
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
        WorkbenchError: if it doesn't fit.
    """
    if isinstance(space, FITS[algorithm]):
        return
    fitting = [name for name in CLASSES if isinstance(space, FITS[name])]
    others = [*fitting, *(["dqn_train.py"] if isinstance(space, spaces.Discrete) else [])]
    hint = f"{', '.join(others)} fit it" if others else "none here fits it"
    raise WorkbenchError(f"{algorithm} can't choose from {space}, the actions of {env_id}; {hint}")


def make_model(choice: SB3Choice, envs: int | None = None) -> Any:
    """A new model with its environments; the caller closes `model.get_env()`.

    Args:
        envs: how many, if not as many as in training.

    Raises:
        WorkbenchError: if the environment can't be made, the algorithm doesn't fit it, or an
            option makes no sense.
    """
    from stable_baselines3.common.vec_env import DummyVecEnv

    run = choice.run
    vector = DummyVecEnv([_maker(choice)] * (envs or run.n_envs))
    try:
        check_fit(choice.algorithm, run.env_id, vector.action_space)
        return _make(choice, vector)
    except WorkbenchError:
        vector.close()
        raise
    except (TypeError, ValueError, AssertionError, RuntimeError, ArithmeticError) as error:
        vector.close()
        text = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise WorkbenchError(f"{choice.algorithm} can't be made: {text}") from error


def _maker(choice: SB3Choice) -> Callable[[], gymnasium.Env[Any, Any]]:
    from stable_baselines3.common.monitor import Monitor

    run = choice.run
    return lambda: Monitor(make_environment(run.env_id, run.env_kwargs))


def _make(choice: SB3Choice, vector: Any) -> Any:
    torch.empty(0, device=choice.run.device)  # where there is none, the model would take the CPU
    own = dict(choice.hyperparameters)
    network = {name: own.pop(name, None) for name in NETWORK}
    network = {name: value for name, value in network.items() if value is not None}
    if "net_arch" in network:
        network["net_arch"] = _layers(network["net_arch"])
    if choice.run.lr_schedule == "linear":
        own["learning_rate"] = linear(_rate(own["learning_rate"]))
    if own.get("action_noise") is not None:
        own["action_noise"] = _noise(own["action_noise"], vector.action_space)
    if isinstance(
        own.get("train_freq"), list
    ):  # a number and a unit; neither YAML nor JSON has tuples
        own["train_freq"] = tuple(own["train_freq"])
    return algorithm_class(choice.algorithm)(
        "MlpPolicy",
        vector,
        seed=choice.run.seed,
        device=choice.run.device,
        policy_kwargs=network or None,
        **own,
    )


def _layers(value: Any) -> Any:
    """Widths of layers, also as the text 64,64; other forms are left to Stable-Baselines3."""
    if not isinstance(value, str | int):
        return value
    try:
        return [int(each) for each in str(value).split(",")]
    except ValueError:
        raise WorkbenchError(f"net_arch is whole numbers, as in 64,64, not {value!r}") from None


def _rate(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise WorkbenchError(f"learning_rate is a number, not {value!r}")
    return float(value)


def linear(start: float) -> Callable[[float], float]:
    """A rate that falls to 0 with what remains of the training."""
    return lambda remaining: start * remaining


def _noise(deviation: Any, space: spaces.Box) -> Any:
    """The option action_noise is a standard deviation, of each action alike."""
    from stable_baselines3.common.noise import NormalActionNoise

    if not isinstance(deviation, int | float):
        raise WorkbenchError(f"action_noise is a standard deviation, a number, not {deviation!r}")
    return NormalActionNoise(np.zeros(space.shape), np.full(space.shape, float(deviation)))


def greedy(model: Any) -> Callable[[np.ndarray], Any]:
    """The model as a function of one observation (D,)."""

    def act(observation: np.ndarray) -> Any:
        return model.policy.predict(observation, deterministic=True)[0]

    return act
