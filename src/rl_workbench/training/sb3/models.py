"""Stable-Baselines3's models made from our options; what fits which actions."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import gymnasium
import numpy as np
import torch
from gymnasium import spaces
from stable_baselines3.common.vec_env import DummyVecEnv

from rl_workbench.errors import WorkbenchError
from rl_workbench.training.algorithm import training_environments
from rl_workbench.training.algorithms import ALGORITHMS
from rl_workbench.training.checked import BEGIN_STEP, COMPUTE_REWARD, CheckedEnvironment
from rl_workbench.training.environments import NumberedEnvironment, close_all, has_goal
from rl_workbench.training.options import TrainingOptions
from rl_workbench.training.repeatable import RepeatableEnvironment
from rl_workbench.training.sb3.hyperparameters import ON_POLICY, SB3Options

FITS = {
    "sac": (spaces.Box,),
    "td3": (spaces.Box,),
    "ddpg": (spaces.Box,),
    "dqn-sb3": (spaces.Discrete,),
    **dict.fromkeys(
        ON_POLICY, (spaces.Box, spaces.Discrete, spaces.MultiDiscrete, spaces.MultiBinary)
    ),
}


NETWORK = ("net_arch", "log_std_init")  # of policy_kwargs, given like any other option


def algorithm_class(name: str) -> Any:
    """Returns Stable-Baselines3's class by the value of --algo."""
    import stable_baselines3

    return getattr(stable_baselines3, ALGORITHMS[name].hyperparameters().library_class)


def check_fit(algorithm: str, env_id: str, space: gymnasium.Space[Any]) -> None:
    """Refuses an algorithm whose actions aren't the environment's; names those that fit.

    Raises:
        WorkbenchError: if it doesn't fit.
    """
    if isinstance(space, FITS[algorithm]):
        return
    fitting = [name for name in FITS if isinstance(space, FITS[name])]
    others = [*fitting, *(["dqn", "reinforce"] if isinstance(space, spaces.Discrete) else [])]
    hint = f"{', '.join(others)} fit it" if others else "none here fits it"
    raise WorkbenchError(f"{algorithm} can't choose from {space}, the actions of {env_id}; {hint}")


def make_model(options: TrainingOptions, acts_in: gymnasium.Env[Any, Any] | None = None) -> Any:
    """A new model with its environments; the caller closes `model.get_env()`.

    Args:
        acts_in: for a model that only acts: the environment, instead of those that it learned in,
            which may have been a simulator's; then the model has no room to learn.

    Raises:
        WorkbenchError: if the environment can't be made, the algorithm doesn't fit it, or an
            option makes no sense.
    """
    from stable_baselines3.common.vec_env import DummyVecEnv

    from rl_workbench.training.sb3.adapter import asking_class
    from rl_workbench.training.sb3.models import SideBySide

    name, run, own = options.kind.name, options.run, options.hyperparameters.own
    vector: DummyVecEnv
    if acts_in is None:
        vector = SideBySide([watched(env) for env in training_environments(options)])
    else:
        vector = DummyVecEnv([lambda: acts_in])
        if name in ON_POLICY:  # of one environment as many steps as of all
            own["n_steps"] *= run.num_envs
        else:
            own["buffer_size"] = 1  # nothing is learned, so nothing is kept
    try:
        check_fit(name, run.env_id, vector.action_space)
        if acts_in is not None:
            return model_in(vector, options, own)
        return model_in(vector, options, own, asking_class(name), **_hindsight(options, vector))
    except WorkbenchError:
        if acts_in is None:
            vector.close()
        raise


def model_in(
    vector: Any, options: TrainingOptions, own: dict[str, Any], kind: Any = None, **replay: Any
) -> Any:
    """A new model in environments that fit it, whoever made them.

    Args:
        vector: Stable-Baselines3's vector environment.
        options: of the training.
        own: the algorithm's own options; emptied.
        kind: the model's class, if it isn't the algorithm's own.
        replay: arguments that are the replay buffer's.

    Raises:
        WorkbenchError: if an option makes no sense.
    """
    from stable_baselines3.common.logger import Logger

    name, run = options.kind.name, options.run
    sees_dict = isinstance(vector.observation_space, spaces.Dict)
    try:
        torch.empty(0, device=run.device)  # where there is none, the model would take the CPU
        model = (kind or algorithm_class(name))(
            "MultiInputPolicy" if sees_dict else "MlpPolicy",
            vector,
            seed=run.seed,
            device=run.device,
            policy_kwargs=_network(own),
            **replay,
            **_translated(options.hyperparameters, own, vector.action_space),
        )
    except (TypeError, ValueError, AssertionError, RuntimeError, ArithmeticError) as error:
        if isinstance(error, WorkbenchError):
            raise
        text = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise WorkbenchError(f"{name} can't be made: {text}") from error
    model.set_logger(Logger(None, []))  # it remembers what the model tells
    return model


def watched(env: gymnasium.Env[Any, Any]) -> RepeatableEnvironment:
    """An environment whose episodes are counted, and can be brought back with what was counted."""
    from stable_baselines3.common.monitor import Monitor

    return RepeatableEnvironment(Monitor(env))


def checked_of(vector: Any) -> CheckedEnvironment:
    """The first environment of a model, below what watches, and what numbers it."""
    env = vector.envs[0].env.env
    checked = env.env if isinstance(env, NumberedEnvironment) else env
    assert isinstance(checked, CheckedEnvironment)
    return checked


def _hindsight(options: TrainingOptions, vector: Any) -> dict[str, Any]:
    """The replay buffer, if it is to be that of hindsight experience replay.

    Raises:
        WorkbenchError: if the environment has no goals.
    """
    settings, env_id = options.hyperparameters, options.run.env_id
    if not getattr(settings, "her", False):
        return {}
    from stable_baselines3 import HerReplayBuffer

    if not has_goal(vector.observation_space):
        raise WorkbenchError(
            f"her needs goals: a Dict of observation, achieved_goal and desired_goal; {env_id} observes "
            f"{' '.join(str(vector.observation_space).split())}"
        )
    if not checked_of(vector).can_compute_reward:
        raise WorkbenchError(
            f"her needs {env_id}'s method {COMPUTE_REWARD}(achieved_goal, desired_goal, info)"
        )
    return {
        "replay_buffer_class": HerReplayBuffer,
        "replay_buffer_kwargs": {
            "n_sampled_goal": settings.n_sampled_goal,
            "goal_selection_strategy": settings.goal_selection_strategy,
        },
    }


def _network(own: dict[str, Any]) -> dict[str, Any] | None:
    """Takes the network's options out of the algorithm's."""
    network = {name: own.pop(name, None) for name in NETWORK}
    network = {name: value for name, value in network.items() if value is not None}
    if "net_arch" in network:
        network["net_arch"] = _layers(network["net_arch"])
    return network or None


def _translated(
    settings: SB3Options, own: dict[str, Any], actions: gymnasium.Space[Any]
) -> dict[str, Any]:
    """What no file can hold, made from what it can."""
    if settings.lr_schedule == "linear":
        own["learning_rate"] = linear(_rate(own["learning_rate"]))
    if own.get("action_noise") is not None:
        own["action_noise"] = _noise(own["action_noise"], actions)
    if isinstance(own.get("train_freq"), list):  # a number and a unit
        own["train_freq"] = tuple(own["train_freq"])
    return own


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
    """A rate that falls to 0 with what remains of the training; the last rollout may go beyond its end."""
    return lambda remaining: start * max(remaining, 0.0)


def _noise(deviation: Any, space: gymnasium.Space[Any]) -> Any:
    """The option action_noise is a standard deviation, of each action alike."""
    from stable_baselines3.common.noise import NormalActionNoise

    if not isinstance(deviation, int | float):
        raise WorkbenchError(f"action_noise is a standard deviation, a number, not {deviation!r}")
    shape = space.shape or ()
    return NormalActionNoise(np.zeros(shape), np.full(shape, float(deviation)))


class SideBySide(DummyVecEnv):
    """Steps all environments in turn; where a step's work is done elsewhere, as in simulators, it is done for
    all of them at the same time.

    Args:
        envs: each with a robot of its own.
    """

    def __init__(self, envs: Sequence[gymnasium.Env[Any, Any]]) -> None:
        super().__init__([partial(_itself, env) for env in envs])
        self._begins = [env.get_wrapper_attr(BEGIN_STEP) for env in envs] if len(envs) > 1 else []

    def step_async(self, actions: np.ndarray) -> None:
        """Has the steps begin; `step_wait` takes them."""
        super().step_async(actions)
        for begin, action in zip(self._begins, actions, strict=False):
            begin(action)

    def close(self) -> None:
        """Closes all environments."""
        close_all(self.envs)


def _itself(env: gymnasium.Env[Any, Any]) -> gymnasium.Env[Any, Any]:
    return env
