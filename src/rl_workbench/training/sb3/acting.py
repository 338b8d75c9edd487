"""What a model of Stable-Baselines3 has learned: a policy, also as a torch module without the library."""

from typing import Any

import gymnasium
import torch
from gymnasium import spaces
from stable_baselines3.common.torch_layers import CombinedExtractor, FlattenExtractor, NatureCNN
from stable_baselines3.common.vec_env import VecTransposeImage
from torch import nn

from rl_workbench.agents.greedy import (
    ClippedAction,
    Continuous,
    SeveralChoices,
    SingleChoice,
    Switches,
)
from rl_workbench.training.algorithm import Policy
from rl_workbench.training.environments import is_image
from rl_workbench.training.options import TrainingOptions
from rl_workbench.training.sb3.hyperparameters import ON_POLICY
from rl_workbench.training.sb3.models import is_name, make_acting_model


def load_policy(
    options: TrainingOptions, content: dict[str, Any], env: gymnasium.Env[Any, Any]
) -> Policy:
    """Makes the policy of a checkpoint; see `algorithm`.

    The checkpoint holds plain tensors, and the model is made from the recorded options. So a foreign file
    can't run code, as it could in Stable-Baselines3's own zip.
    """
    model = make_acting_model(options, env)
    model.policy.load_state_dict(content["policy"])

    def act(observation: Any) -> Any:
        return model.policy.predict(observation, deterministic=True)[0]

    if is_name(options.hyperparameters.policy):
        return Policy(act, None)
    return Policy(act, greedy_network(model, options.kind.name))


def greedy_network(model: Any, algorithm: str) -> nn.Module | None:
    """Returns what `model.predict(..., deterministic=True)` computes; see `Policy`.

    Args:
        model: With a policy of Stable-Baselines3's own.
        algorithm: The value of --algo.
    """
    policy, actions = model.policy, model.action_space
    actor = policy if algorithm in ON_POLICY else getattr(policy, "actor", None) or policy.q_net
    features = _features(actor.features_extractor, model)
    if features is None:
        return None
    if algorithm == "dqn-sb3":
        return SingleChoice(nn.Sequential(*features, *actor.q_net))
    if algorithm in ON_POLICY:
        outputs = nn.Sequential(*features, policy.mlp_extractor.policy_net, policy.action_net)
        if isinstance(actions, spaces.Box):
            return ClippedAction(outputs, actions.low, actions.high)
        if isinstance(actions, spaces.MultiDiscrete):
            return SeveralChoices(outputs, actions.nvec.tolist())
        is_binary = isinstance(actions, spaces.MultiBinary)
        return Switches(outputs) if is_binary else SingleChoice(outputs)
    if algorithm == "sac":  # its actor gives the mean before it is squashed
        outputs = nn.Sequential(*features, actor.latent_pi, actor.mu, nn.Tanh())
    else:
        outputs = nn.Sequential(*features, *actor.mu)
    return ScaledAction(outputs, actions.low, actions.high)


def _features(extractor: nn.Module, model: Any) -> list[nn.Module] | None:
    """Returns the layers before an actor's own: none for vectors; None for those that aren't known."""
    if isinstance(extractor, NatureCNN):
        turns = isinstance(model.get_env(), VecTransposeImage)
        return [Pixels(turns), extractor.cnn, extractor.linear]
    space = model.observation_space
    parts = space.values() if isinstance(space, spaces.Dict) else [space]
    is_plain = isinstance(extractor, FlattenExtractor | CombinedExtractor)
    return [] if is_plain and not any(map(is_image, parts)) else None


class Pixels(nn.Module):
    """Images (N, height, width, channels), from 0 to 255, as a CNN takes them: (N, channels, ...), 0 to 1.

    Args:
        turns: Whether channels come last; else they come first already.
    """

    def __init__(self, turns: bool) -> None:
        super().__init__()
        self.turns = turns

    def forward(self, images: torch.Tensor) -> torch.Tensor:
        return (images.permute(0, 3, 1, 2) if self.turns else images) / 255.0


class ScaledAction(Continuous):
    """The outputs, from -1 to 1, spread over the action space."""

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        share = 0.5 * (self.outputs(observations).reshape(self.shape) + 1.0)
        return self.low + share * (self.high - self.low)
