"""Policies of Stable-Baselines3's models, also as torch modules without the library."""

from typing import Any

import torch
from gymnasium import spaces
from torch import nn

from rl_workbench.agents.greedy import (
    ClippedAction,
    Continuous,
    SeveralChoices,
    SingleChoice,
    Switches,
)
from rl_workbench.training.algorithm import Policy
from rl_workbench.training.checked import Env
from rl_workbench.training.environments import is_image
from rl_workbench.training.options import TrainingOptions
from rl_workbench.training.sb3.hyperparameters import ON_POLICY
from rl_workbench.training.sb3.models import make_acting_model


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
