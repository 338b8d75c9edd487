"""REINFORCE with a learned baseline: generalised advantages, one step of the policy a batch of episodes.

Against the document's algorithm (policy_gradient.py) it differs in four things, each of which takes variance
out of the gradient: advantages are weighted sums of temporal differences (Schulman et al. 2016, λ = 0.95)
instead of whole returns; they are normalised over the batch; the baseline is fitted to each batch, not
nudged towards it once; and observations come scaled, so that one learning rate suits all weights. A
truncated episode bootstraps from the baseline, a terminated one doesn't.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import nn

from cartpole.agents.policy_gradient import (
    Episode,
    Losses,
    PolicyNetwork,
    check_finite,
    descend,
    start_at_zero,
)

SMALLEST_SPREAD = 1e-8  # of advantages, below which they are not blown up


@dataclass(frozen=True)
class ReinforceSettings:
    """The algorithm's constants."""

    gamma: float = 0.99
    gae_lambda: float = 0.95
    policy_learning_rate: float = 0.03
    value_learning_rate: float = 0.01
    value_epochs: int = 20  # steps of the baseline for each batch
    batch_episodes: int = 1  # episodes for each step of the policy
    hidden: int = 32  # units in each of the baseline's two layers


class BaselineNetwork(nn.Module):
    """Scaled observation (N, 4) to the estimated return (N, 1)."""

    def __init__(self, hidden: int) -> None:
        super().__init__()
        self.layers = nn.Sequential(
            nn.Linear(4, hidden), nn.Tanh(),
            nn.Linear(hidden, hidden), nn.Tanh(),
            nn.Linear(hidden, 1),
        )  # fmt: skip

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        return self.layers(observations)


class ReinforceAgent:
    """Learns from batches of whole episodes; the policy is linear in the scaled observation.

    Args:
        seed: makes initial weights and the choice of actions repeatable, through generators of
            its own.
        scale: what an observation is divided by, of shape (4,).
        settings: the algorithm's constants.
    """

    def __init__(
        self,
        seed: int = 0,
        scale: Sequence[float] = (1.0, 1.0, 1.0, 1.0),
        settings: ReinforceSettings | None = None,
    ) -> None:
        self.settings = settings or ReinforceSettings()
        with torch.random.fork_rng():
            torch.manual_seed(seed)
            self.policy = PolicyNetwork()
            self.value = BaselineNetwork(self.settings.hidden)
        start_at_zero(self.policy.fc)
        rates = (self.settings.policy_learning_rate, self.settings.value_learning_rate)
        self.policy_optimizer = torch.optim.Adam(self.policy.parameters(), rates[0])
        self.value_optimizer = torch.optim.Adam(self.value.parameters(), rates[1])
        self._rng = np.random.default_rng(seed)
        self._factors = 1.0 / np.asarray(scale, np.float32)  # (4,)
        self._batch: list[Episode] = []
        self._losses = Losses(0.0, 0.0)
        self.sync()

    def sync(self) -> None:
        """Copies the policy's weights to where acting reads them."""
        weight = self.policy.fc.weight.detach().numpy()  # (2, 4)
        bias = self.policy.fc.bias.detach().numpy()  # (2,)
        self._weight = (weight[1] - weight[0]) * self._factors
        self._bias = float(bias[1] - bias[0])

    def probability_of_zero(self, observation: np.ndarray) -> float:
        """The policy's probability of action 0 for an observation of shape (4,)."""
        preference = float(self._weight @ observation) + self._bias
        return 1.0 / (1.0 + math.exp(min(preference, 700.0)))

    def act(self, observation: np.ndarray) -> int:
        """Draws an action from the policy."""
        return 0 if self._rng.random() < self.probability_of_zero(observation) else 1

    def act_greedily(self, observation: np.ndarray) -> int:
        """The more probable action."""
        return 0 if self.probability_of_zero(observation) >= 0.5 else 1

    def learn(self, episode: Episode) -> Losses:
        """Takes an episode; the last one of a batch updates both networks.

        Returns:
            The losses of the last update, taken before it.

        Raises:
            CartpoleError: if a loss isn't finite; the networks are as before then.
        """
        self._batch.append(episode)
        if len(self._batch) >= self.settings.batch_episodes:
            batch, self._batch = self._batch, []
            self._losses = self._update(batch)
            self.sync()
        return self._losses

    def _update(self, batch: list[Episode]) -> Losses:
        observations = torch.cat([self._scaled(episode.observations) for episode in batch])
        actions = torch.tensor([action for episode in batch for action in episode.actions])
        advantages, targets = self._judge(batch)
        spread = float(advantages.std(correction=0))
        advantages = (advantages - advantages.mean()) / (spread + SMALLEST_SPREAD)
        chosen = torch.log(self.policy(observations).gather(1, actions.unsqueeze(1)).squeeze(1))
        policy_loss = -(chosen * advantages).mean()
        value_loss = self._value_loss(observations, targets)
        losses = Losses(policy_loss.item(), value_loss.item())
        check_finite(losses)
        descend(self.policy_optimizer, policy_loss)
        for _ in range(self.settings.value_epochs):
            descend(self.value_optimizer, self._value_loss(observations, targets))
        return losses

    def _judge(self, batch: list[Episode]) -> tuple[torch.Tensor, torch.Tensor]:
        """Advantages and the baseline's targets, each (T,) over all episodes' steps."""
        advantages, targets = [], []
        for episode in batch:
            values = self._values(episode)
            found = generalised_advantages(
                episode.rewards, values, self.settings.gamma, self.settings.gae_lambda
            )
            advantages.append(found)
            targets.append(found + values[:-1])
        return tuple(  # type: ignore[return-value]
            torch.from_numpy(np.concatenate(each).astype(np.float32))
            for each in (advantages, targets)
        )

    def _values(self, episode: Episode) -> np.ndarray:
        """The baseline at each state, the final one included: (T + 1,); 0 where nothing follows."""
        if episode.final_observation is None:
            raise ValueError("the episode isn't over")
        states = [*episode.observations, episode.final_observation]
        with torch.no_grad():
            values = self.value(self._scaled(states)).squeeze(1).double().numpy()
        if episode.terminated:
            values[-1] = 0.0
        return values

    def _scaled(self, observations: Sequence[np.ndarray]) -> torch.Tensor:
        return torch.from_numpy(np.stack(observations) * self._factors)

    def _value_loss(self, observations: torch.Tensor, targets: torch.Tensor) -> torch.Tensor:
        return nn.functional.mse_loss(self.value(observations).squeeze(1), targets)


def generalised_advantages(
    rewards: Sequence[float], values: np.ndarray, gamma: float, gae_lambda: float
) -> np.ndarray:
    """Â_t = Σ_k (γλ)^k δ_{t+k} with δ_t = r_t + γ V(s_{t+1}) - V(s_t) (Schulman et al. 2016, eq. 16).

    Args:
        rewards: of T steps.
        values: V at the T states and the final one, (T + 1,).

    Returns:
        float64, (T,).
    """
    advantages = np.empty(len(rewards))
    following = 0.0
    for index in range(len(rewards) - 1, -1, -1):
        difference = rewards[index] + gamma * values[index + 1] - values[index]
        following = difference + gamma * gae_lambda * following
        advantages[index] = following
    return advantages
