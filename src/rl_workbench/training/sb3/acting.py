"""The greedy policies of Stable-Baselines3's models as torch modules that need no Stable-Baselines3."""

from typing import Any

import torch
from gymnasium import spaces
from torch import nn

from rl_workbench.agents.greedy import Choice, ClippedAction, Continuous, SingleChoice, lead
from rl_workbench.training.sb3.hyperparameters import ON_POLICY


def greedy_network(model: Any, algorithm: str) -> nn.Module:
    """What `model.predict(..., deterministic=True)` computes, from observations (N, D) on.

    Args:
        model: with the policy MlpPolicy, or MultiInputPolicy on vectors.
        algorithm: one of `options.CLASSES`.
    """
    policy, actions = model.policy, model.action_space
    if algorithm == "dqn-sb3":
        return SingleChoice(policy.q_net.q_net)
    if algorithm in ON_POLICY:
        outputs = nn.Sequential(policy.mlp_extractor.policy_net, policy.action_net)
        return _of_distribution(outputs, actions)
    if algorithm == "sac":  # its actor tells the mean before it is squashed
        actor = nn.Sequential(policy.actor.latent_pi, policy.actor.mu, nn.Tanh())
    else:
        actor = policy.actor.mu
    return ScaledAction(actor, actions.low, actions.high)


def _of_distribution(outputs: nn.Module, actions: spaces.Space[Any]) -> nn.Module:
    if isinstance(actions, spaces.Box):
        return ClippedAction(outputs, actions.low, actions.high)
    if isinstance(actions, spaces.MultiDiscrete):
        return SeveralChoices(outputs, actions)
    return Switches(outputs) if isinstance(actions, spaces.MultiBinary) else SingleChoice(outputs)


class SeveralChoices(Choice):
    """One action of each group of scores, (N, groups).

    Args:
        scores: of all groups side by side.
        actions: tells how large they are.
    """

    def __init__(self, scores: nn.Module, actions: spaces.MultiDiscrete) -> None:
        super().__init__(scores)
        self.sizes: list[int] = actions.nvec.tolist()

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        groups = self.scores(observations).split(self.sizes, dim=1)
        return torch.stack([group.argmax(dim=1) for group in groups], dim=1)

    def margins(self, observations: torch.Tensor) -> torch.Tensor:
        """See `Choice`."""
        groups = self.scores(observations).split(self.sizes, dim=1)
        return torch.stack([lead(group) for group in groups], dim=1).amin(dim=1)


class Switches(Choice):
    """Which of the scores are positive: each 0 or 1, (N, A)."""

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        return (self.scores(observations) > 0.0).long()

    def margins(self, observations: torch.Tensor) -> torch.Tensor:
        """See `Choice`."""
        return self.scores(observations).abs().amin(dim=1)


class ScaledAction(Continuous):
    """The outputs, from -1 to 1, spread over the space."""

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        share = 0.5 * (self.outputs(observations).reshape(self.shape) + 1.0)
        return self.low + share * (self.high - self.low)
