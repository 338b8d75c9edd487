"""Softmax and Gaussian policies: torch networks that learn; NumPy actors, several times as fast."""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import torch
from torch import nn

SMALLEST_CHANCE = float(np.finfo(np.float32).tiny)  # lower bound of probabilities in the entropy


class PolicyNetworkBase(nn.Module):
    """A linear layer from D to A, after a hidden tanh layer if it has any units."""

    def __init__(self, observations: int, outputs: int, hidden: int) -> None:
        super().__init__()
        if hidden:
            self.hidden = nn.Linear(observations, hidden)
        self.fc = nn.Linear(hidden or observations, outputs)
        self.has_hidden = bool(hidden)

    def outputs(self, observations: torch.Tensor) -> torch.Tensor:
        """Returns the outputs (N, A) for prepared observations (N, D)."""
        if self.has_hidden:
            observations = torch.tanh(self.hidden(observations))
        return self.fc(observations)

    def layers(self) -> list[nn.Module]:
        """Returns the layers from prepared observations to the outputs."""
        return [self.hidden, nn.Tanh(), self.fc] if self.has_hidden else [self.fc]

    def in_numpy(self) -> Callable[[np.ndarray], np.ndarray]:
        """Returns a copy that maps a prepared observation (D,) to the outputs (A,)."""
        layers = [self.hidden, self.fc] if self.has_hidden else [self.fc]
        *hidden, (weight, bias) = [
            (layer.weight.detach().numpy().copy(), layer.bias.detach().numpy().copy()) for layer in layers
        ]

        def outputs(seen: np.ndarray) -> np.ndarray:
            for matrix, offset in hidden:
                seen = np.tanh(matrix @ seen + offset)
            return np.asarray(weight @ seen + bias)

        return outputs


class SoftmaxNetwork(PolicyNetworkBase):
    """Maps prepared observations (N, D) to the probabilities of the actions (N, A)."""

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        return torch.softmax(self.outputs(observations), dim=1)

    def log_chances(self, probabilities: torch.Tensor, actions: torch.Tensor) -> torch.Tensor:
        """Returns the log-probabilities (N,) of actions (N,)."""
        return torch.log(probabilities.gather(1, actions.unsqueeze(1)).squeeze(1))

    def entropy(self, probabilities: torch.Tensor) -> torch.Tensor:
        """Returns the policy's entropy, averaged over the observations."""
        # At a probability of 0 the entropy's slope is infinite.
        return torch.special.entr(probabilities.clamp_min(SMALLEST_CHANCE)).sum(1).mean()


class PairActor:
    """Acts by one dot product: for two actions and no hidden layer. Factors (D,) multiply observations."""

    def __init__(self, network: SoftmaxNetwork, factors: np.ndarray) -> None:
        weight = network.fc.weight.detach().numpy()  # (2, D)
        bias = network.fc.bias.detach().numpy()  # (2,)
        self._weight = (weight[1] - weight[0]) * factors
        self._bias = float(bias[1] - bias[0])

    def _first(self, observation: np.ndarray) -> float:
        preference = float(self._weight @ observation) + self._bias
        return 1.0 / (1.0 + math.exp(min(preference, 700.0)))

    def draw(self, observation: np.ndarray, generator: np.random.Generator) -> int:
        return 0 if generator.random() < self._first(observation) else 1

    def greedy(self, observation: np.ndarray) -> int:
        return 0 if self._first(observation) >= 0.5 else 1


class SoftmaxActor:
    """Acts for any number of actions, with or without a hidden layer."""

    def __init__(self, network: SoftmaxNetwork, prepare: Callable[[np.ndarray], np.ndarray]) -> None:
        self._prepare, self._outputs = prepare, network.in_numpy()

    def _preferences(self, observation: np.ndarray) -> np.ndarray:
        return self._outputs(self._prepare(observation)).astype(np.float64)

    def probabilities(self, observation: np.ndarray) -> np.ndarray:
        """Returns the probabilities of the actions, (A,), float64."""
        preferences = self._preferences(observation)
        weights = np.exp(preferences - preferences.max())
        return weights / weights.sum()

    def draw(self, observation: np.ndarray, generator: np.random.Generator) -> int:
        ends = np.cumsum(self.probabilities(observation))
        return min(int(np.searchsorted(ends, generator.random(), side="right")), len(ends) - 1)

    def greedy(self, observation: np.ndarray) -> int:
        return int(np.argmax(self._preferences(observation)))


SMALLEST_LOG_STD = -4.0  # a policy that always draws the same action stops learning
HALF_LOG_2_PI = 0.5 * math.log(2.0 * math.pi)


class Bounds(NamedTuple):
    """The smallest and the largest action: two arrays of the action space's shape and type."""

    low: np.ndarray
    high: np.ndarray

    @property
    def middle(self) -> np.ndarray:
        """The middle of the range, (n,), float32; 0 where it is unbounded."""
        low, high = self._ends()
        return (0.5 * (low + high)).ravel().astype(np.float32)

    @property
    def half(self) -> np.ndarray:
        """Half of the range, (n,), float32; 1 where it is unbounded."""
        low, high = self._ends()
        return np.where(high > low, 0.5 * (high - low), 1.0).ravel().astype(np.float32)

    def _ends(self) -> tuple[np.ndarray, np.ndarray]:
        """Returns both ends as float64; -1 and 1 where either is infinite."""
        has_both = np.isfinite(self.low) & np.isfinite(self.high)
        low, high = (np.where(has_both, end, 0.0).astype(np.float64) for end in self)
        return np.where(has_both, low, -1.0), np.where(has_both, high, 1.0)

    def limited(self, action: np.ndarray) -> np.ndarray:
        """Clips an action (n,) to the range, and returns it in the space's shape and type."""
        shaped = action.reshape(self.low.shape).astype(self.low.dtype)
        return np.asarray(np.clip(shaped, self.low, self.high))


class GaussianNetwork(PolicyNetworkBase):
    """Maps prepared observations (N, D) to the actions' means (N, n), in half-ranges from the middle."""

    def __init__(self, observations: int, bounds: Bounds, hidden: int, log_std: float) -> None:
        super().__init__(observations, bounds.low.size, hidden)
        self.log_std = nn.Parameter(torch.full((bounds.low.size,), log_std))
        self._middle, self._half = torch.from_numpy(bounds.middle), torch.from_numpy(bounds.half)

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        return self.outputs(observations)

    def deviations(self) -> torch.Tensor:
        """Returns the logarithms of the standard deviations, (n,)."""
        return self.log_std.clamp_min(SMALLEST_LOG_STD)

    def log_chances(self, means: torch.Tensor, actions: torch.Tensor) -> torch.Tensor:
        """Returns the log-densities (N,) of actions (N, n)."""
        log_std = self.deviations()
        distance = ((actions - self._middle) / self._half - means) * torch.exp(-log_std)
        return -(0.5 * distance**2 + log_std + HALF_LOG_2_PI).sum(1)

    def entropy(self, means: torch.Tensor) -> torch.Tensor:
        """Returns the policy's entropy, which is the same in every state."""
        return (self.deviations() + HALF_LOG_2_PI + 0.5).sum()


class GaussianActor:
    """Acts with a copy of a network's weights; see `Actor`."""

    def __init__(
        self, network: GaussianNetwork, bounds: Bounds, prepare: Callable[[np.ndarray], np.ndarray]
    ) -> None:
        self._prepare, self._outputs, self._bounds = prepare, network.in_numpy(), bounds
        self._middle, self._half = bounds.middle, bounds.half
        self._std = np.exp(network.deviations().detach().numpy())

    def _mean(self, observation: np.ndarray) -> np.ndarray:
        return self._outputs(self._prepare(observation))

    def draw(self, observation: np.ndarray, generator: np.random.Generator) -> np.ndarray:
        """Draws an action (n,), float32, which may lie outside its range."""
        noise = generator.standard_normal(len(self._std), np.float32)
        return self._middle + self._half * (self._mean(observation) + self._std * noise)

    def greedy(self, observation: np.ndarray) -> np.ndarray:
        """Returns the mean action, clipped to its range."""
        return self._bounds.limited(self._middle + self._half * self._mean(observation))


Actor = PairActor | SoftmaxActor | GaussianActor
"""Acts with a copy of a network's weights, for observations (D,) as the environment returns them.

`draw` returns an action in the form that the agent learns from, `greedy` in that which the environment takes.
"""
