"""Policy gradient with a value baseline: a linear softmax policy, one update per episode.

This is the existing script's algorithm. The advantage of a step is its discounted return less the value
network's estimate before the update. The policy's loss is the sum, not the mean, of -log pi(a|s) A; the
value's loss is the mean squared error to the returns.
"""

import math

import numpy as np
import torch
from torch import nn

from rl_workbench.agents.greedy import SingleChoice
from rl_workbench.agents.policy_gradient import (
    Episode,
    Losses,
    TwoNetworks,
    check_finite,
    descend,
    discounted_sums,
    start_at_zero,
)
from rl_workbench.agents.settings import DocumentSettings


class PolicyNetwork(nn.Module):
    """Maps observations (N, 4) to the probabilities of the two actions (N, 2)."""

    def __init__(self) -> None:
        super().__init__()
        self.fc = nn.Linear(4, 2)

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        return torch.softmax(self.fc(observations), dim=1)


class ValueNetwork(nn.Module):
    """Maps observations (N, 4) to the estimated return (N, 1)."""

    def __init__(self) -> None:
        super().__init__()
        self.fc1 = nn.Linear(4, 10)
        self.relu = nn.ReLU()
        self.fc2 = nn.Linear(10, 1)

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        return self.fc2(self.relu(self.fc1(observations)))


class PolicyGradientAgent(TwoNetworks):
    """Learns from whole episodes; acts from a NumPy copy of the linear policy.

    Both output layers start at zero: a uniform policy, and a value of 0 everywhere. With random output
    layers, as in the existing script, several seeds in ten need more than 600 episodes: a policy weight of
    the wrong sign has to be unlearned, and a hidden unit with a negative weight to the value's output soon
    dies, since returns are positive. `seed` is of initial weights and actions.
    """

    def __init__(self, seed: int = 0, settings: DocumentSettings | None = None) -> None:
        self.settings = settings = settings or DocumentSettings()
        with torch.random.fork_rng():
            torch.manual_seed(seed)
            policy, value = PolicyNetwork(), ValueNetwork()
        if not settings.random_weights:
            start_at_zero(policy.fc)
            start_at_zero(value.fc2)
        rates = (settings.policy_learning_rate, settings.value_learning_rate)
        super().__init__(policy, value, rates, seed)
        self._output = policy.fc
        self.sync()

    def sync(self) -> None:
        """Copies the policy's weights to where acting reads them."""
        self._weight = self._output.weight.detach().numpy().copy()  # (2, 4)
        self._bias = self._output.bias.detach().numpy().copy()  # (2,)

    def probability_of_zero(self, observation: np.ndarray) -> float:
        """Returns the probability of action 0 for an observation (4,), eight times as fast as torch."""
        left, right = (self._weight @ observation + self._bias).tolist()
        return 1.0 / (1.0 + math.exp(min(right - left, 700.0)))

    def draw(self, observation: np.ndarray, generator: np.random.Generator) -> int:
        """Draws an action from the policy with the given generator."""
        return 0 if generator.random() < self.probability_of_zero(observation) else 1

    def limited(self, action: int) -> int:
        """Returns a drawn action in the form that the environment takes; here it is the same."""
        return action

    def act_greedily(self, observation: np.ndarray) -> int:
        """Returns the more probable action."""
        return 0 if self.probability_of_zero(observation) >= 0.5 else 1

    def greedy_network(self) -> SingleChoice:
        """Returns the greedy policy as a torch module: observations (N, 4) to actions (N,)."""
        return SingleChoice(self._output)

    def learn(self, episode: Episode) -> Losses:
        """Updates both networks once from one episode.

        Raises WorkbenchError if a loss or the policy's gradient isn't finite, before any weight changes; or
        if the value's gradient isn't.
        """
        observations = torch.from_numpy(np.stack(episode.observations))  # (T, 4)
        actions = torch.tensor(episode.actions)  # (T,)
        returns = torch.from_numpy(discounted_sums(episode.rewards, self.settings.gamma))  # (T,), float64
        values = self.value(observations).squeeze(1)  # (T,)
        advantages = (returns - values.detach().double()).float()
        value_loss = nn.functional.mse_loss(values, returns.float())
        chosen = self.policy(observations).gather(1, actions.unsqueeze(1)).squeeze(1)
        policy_loss = -torch.sum(torch.log(chosen) * advantages)
        losses = Losses(policy_loss.item(), value_loss.item())
        check_finite(losses)
        descend(self.policy_optimizer, policy_loss)
        descend(self.value_optimizer, value_loss)
        self.sync()
        return losses
