"""Stable-Baselines3's models, made from our options, and their policies, also as torch modules."""

from collections.abc import Callable, Sequence
from itertools import repeat
from typing import Any

import gymnasium
import numpy as np
import stable_baselines3
import torch
from gymnasium import spaces
from stable_baselines3 import HerReplayBuffer
from stable_baselines3.common.logger import Logger
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.noise import NormalActionNoise
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm
from stable_baselines3.common.on_policy_algorithm import OnPolicyAlgorithm
from stable_baselines3.common.type_aliases import RolloutReturn
from stable_baselines3.common.vec_env import DummyVecEnv
from torch import nn

from rl_workbench.agents.greedy import ClippedAction, Continuous, SeveralChoices, SingleChoice, Switches
from rl_workbench.errors import WorkbenchError
from rl_workbench.option import imported
from rl_workbench.training.algorithm import Policy
from rl_workbench.training.checked import BEGIN_STEP, COMPUTE_REWARD, CheckedEnvironment, Env
from rl_workbench.training.environments import has_goal, is_image
from rl_workbench.training.options import TrainingOptions
from rl_workbench.training.repeatable import RepeatableEnvironment
from rl_workbench.training.sb3.hyperparameters import ON_POLICY

_DISCRETE = (spaces.Discrete, spaces.MultiDiscrete, spaces.MultiBinary)
FITS = {
    "ppo": (spaces.Box, *_DISCRETE),
    "a2c": (spaces.Box, *_DISCRETE),
    "sac": (spaces.Box,),
    "td3": (spaces.Box,),
    "ddpg": (spaces.Box,),
    "dqn-sb3": (spaces.Discrete,),
}


class StoppableOnPolicy(OnPolicyAlgorithm):
    """Mix-in for algorithms that learn from a rollout and forget it: the callback may end the training.

    A training can only be saved between two rollouts, since an unfinished rollout has no state to save.
    """

    stride = 0  # steps of the last rollout, in all environments

    def collect_rollouts(self, env: Any, callback: Any, rollout_buffer: Any, n_rollout_steps: int) -> bool:
        return callback.goes_on() and super().collect_rollouts(env, callback, rollout_buffer, n_rollout_steps)


class StoppableOffPolicy(OffPolicyAlgorithm):
    """Mix-in for algorithms with a replay buffer, whose rollouts are `train_freq` long."""

    stride = 0  # steps of the last rollout, in all environments

    def collect_rollouts(self, env: Any, callback: Any, *arguments: Any, **named: Any) -> RolloutReturn:
        if not callback.goes_on():
            return RolloutReturn(0, 0, continue_training=False)
        return super().collect_rollouts(env, callback, *arguments, **named)


class ParallelVecEnv(DummyVecEnv):
    """Begins a step in all environments before it waits: those in other processes run at the same time."""

    def __init__(self, envs: Sequence[Env]) -> None:
        super().__init__([repeat(env).__next__ for env in envs])  # each returns its env
        self._begins = [env.get_wrapper_attr(BEGIN_STEP) for env in envs] if len(envs) > 1 else []

    def step_async(self, actions: np.ndarray) -> None:
        super().step_async(actions)
        for begin, action in zip(self._begins, actions, strict=False):
            begin(action)


def make_learning_model(options: TrainingOptions, envs: Sequence[CheckedEnvironment]) -> Any:
    """Makes a new model in a training's environments."""
    # Monitor counts the episodes inside, so that a repeated episode brings its counts back.
    vector = ParallelVecEnv([RepeatableEnvironment(Monitor(env)) for env in envs])
    _check_fit(options, vector.action_space)
    own = getattr(stable_baselines3, options.hyperparameters.library_class)
    mixin = StoppableOnPolicy if options.kind.name in ON_POLICY else StoppableOffPolicy
    arguments = options.hyperparameters.own | _hindsight(options, envs[0])
    return _model_in(vector, options, arguments, type(own.__name__, (mixin, own), {}))


def make_acting_model(options: TrainingOptions, env: Env) -> Any:
    """Makes a model that only acts, in another environment than those that it learned in."""
    vector = DummyVecEnv([lambda: env])
    _check_fit(options, vector.action_space)
    arguments = options.hyperparameters.own
    if options.kind.name in ON_POLICY:  # as many steps of one environment as of all
        arguments["n_steps"] *= options.run.num_envs
    else:
        arguments["buffer_size"] = 1  # nothing is learned, so nothing is kept
    own = getattr(stable_baselines3, options.hyperparameters.library_class)
    return _model_in(vector, options, arguments, own)


def _check_fit(options: TrainingOptions, space: gymnasium.Space[Any]) -> None:
    name = options.kind.name
    if isinstance(space, FITS[name]):
        return
    others = [other for other, kinds in FITS.items() if isinstance(space, kinds)]
    others += ["dqn", "reinforce"] if isinstance(space, spaces.Discrete) else []
    hint = f"{', '.join(others)} fit it" if others else "none here fits it"
    raise WorkbenchError(f"{name} can't choose from {space}, the actions of {options.run.env_id}; {hint}")


def _model_in(vector: Any, options: TrainingOptions, arguments: dict[str, Any], made_class: Any) -> Any:
    run = options.run
    network = {name: arguments.pop(name) for name in ("net_arch", "log_std_init")}
    network = {name: value for name, value in network.items() if value is not None}
    if "net_arch" in network:
        network["net_arch"] = _layers(network["net_arch"])
    for name, value in options.hyperparameters.policy_kwargs.items():
        network[name] = _named(value, f"--policy-kwargs {name}=")
    if options.hyperparameters.lr_schedule == "linear":
        arguments["learning_rate"] = linear(arguments["learning_rate"])
    if arguments.get("action_noise") is not None:
        shape = vector.action_space.shape or ()
        deviation = np.full(shape, arguments["action_noise"])
        arguments["action_noise"] = NormalActionNoise(np.zeros(shape), deviation)
    if isinstance(arguments.get("train_freq"), list):  # a number and a unit
        arguments["train_freq"] = tuple(arguments["train_freq"])
    space = vector.observation_space
    suits = "CnnPolicy" if is_image(space) else "MlpPolicy"
    suits = "MultiInputPolicy" if isinstance(space, spaces.Dict) else suits
    policy = _named(options.hyperparameters.policy or suits, "--policy")
    try:
        model = made_class(
            policy, vector, seed=run.seed, device=run.device,
            policy_kwargs=network or None, **arguments,
        )  # fmt: skip
    except WorkbenchError:
        raise
    except (TypeError, ValueError, AssertionError, RuntimeError, ArithmeticError) as error:
        text = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise WorkbenchError(f"{options.kind.name} can't be made: {text}") from error
    model.set_logger(Logger(None, []))  # it keeps what the model records
    return model


def _named(value: Any, flag: str) -> Any:
    """Returns the class that a text names as module:Class; other values as they are."""
    if not isinstance(value, str) or ":" not in value:
        return value
    named = imported(value, flag)  # a foreign record mustn't have anything else called
    if not (isinstance(named, type) and issubclass(named, torch.nn.Module | torch.optim.Optimizer)):
        raise WorkbenchError(f"{flag} {value}: it is neither a torch Module nor an Optimizer")
    return named


def _hindsight(options: TrainingOptions, env: CheckedEnvironment) -> dict[str, Any]:
    """Returns the arguments for hindsight experience replay, if it is asked for."""
    settings, env_id = options.hyperparameters, options.run.env_id
    if not getattr(settings, "her", False):
        return {}
    if not has_goal(env.observation_space):
        raise WorkbenchError(
            f"her needs goals: a Dict of observation, achieved_goal and desired_goal; {env_id} observes "
            f"{' '.join(str(env.observation_space).split())}"
        )
    if not env.env.has_wrapper_attr(COMPUTE_REWARD):
        raise WorkbenchError(
            f"her needs {env_id}'s method {COMPUTE_REWARD}(achieved_goal, desired_goal, info)"
        )
    names = ("n_sampled_goal", "goal_selection_strategy")
    return {
        "replay_buffer_class": HerReplayBuffer,
        "replay_buffer_kwargs": {name: getattr(settings, name) for name in names},
    }


def _layers(value: Any) -> Any:
    """Reads widths of layers, also as the text 64,64. Stable-Baselines3 checks any other form."""
    if not isinstance(value, str | int):
        return value
    try:
        return [int(each) for each in str(value).split(",")]
    except ValueError:
        raise WorkbenchError(f"net_arch must be whole numbers, as in 64,64, not {value!r}") from None


def linear(start: float) -> Callable[[float], float]:
    """Returns a rate that falls to 0 with what remains; the last rollout may go beyond the end."""
    return lambda remaining: start * max(remaining, 0.0)


def load_policy(options: TrainingOptions, content: dict[str, Any], env: Env) -> Policy:
    """Makes the policy of a checkpoint; see `algorithm`.

    The checkpoint holds plain tensors, and the model is made from the recorded options. So a foreign file
    can't run code, as it could in Stable-Baselines3's own zip.
    """
    model = make_acting_model(options, env)
    model.policy.load_state_dict(content["policy"])

    def act(observation: Any) -> Any:
        return model.policy.predict(observation, deterministic=True)[0]

    own, space = options.hyperparameters, env.observation_space
    parts = space.values() if isinstance(space, spaces.Dict) else [space]
    others = ":" in own.policy or any("extractor" in name for name in own.policy_kwargs)
    if others or any(map(is_image, parts)):
        return Policy(act, None)
    return Policy(act, greedy_network(model, options.kind.name))


def greedy_network(model: Any, algorithm: str) -> nn.Module:
    """Returns what `model.predict(..., deterministic=True)` computes for observations (N, D), by an MLP."""
    policy, actions = model.policy, model.action_space
    if algorithm == "dqn-sb3":
        return SingleChoice(policy.q_net.q_net)
    if algorithm in ON_POLICY:
        outputs = nn.Sequential(policy.mlp_extractor.policy_net, policy.action_net)
        if isinstance(actions, spaces.Box):
            return ClippedAction(outputs, actions.low, actions.high)
        if isinstance(actions, spaces.MultiDiscrete):
            return SeveralChoices(outputs, actions.nvec.tolist())
        is_binary = isinstance(actions, spaces.MultiBinary)
        return Switches(outputs) if is_binary else SingleChoice(outputs)
    if algorithm == "sac":  # its actor gives the mean before it is squashed
        actor = nn.Sequential(policy.actor.latent_pi, policy.actor.mu, nn.Tanh())
    else:
        actor = policy.actor.mu
    return ScaledAction(actor, actions.low, actions.high)


class ScaledAction(Continuous):
    """The outputs, from -1 to 1, spread over the action space."""

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        share = 0.5 * (self.outputs(observations).reshape(self.shape) + 1.0)
        return self.low + share * (self.high - self.low)
