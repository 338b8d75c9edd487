"""Softmax policies over single actions: the network that learns, and its quick twins that act.

For one observation NumPy is several times as fast as torch.
"""

import math
from collections.abc import Callable
from typing import Any, NamedTuple, Protocol

import numpy as np
import torch
from torch import nn

SMALLEST_CHANCE = float(np.finfo(np.float32).tiny)  # of an action, that counts for the entropy


class SoftmaxNetwork(nn.Module):
    """Prepared observation (N, D) to the probabilities (N, A) of the actions.

    Args:
        observations: D.
        actions: A.
        hidden: units in a layer of tanh between them; 0: none.
    """

    def __init__(self, observations: int, actions: int, hidden: int) -> None:
        super().__init__()
        if hidden:
            self.hidden = nn.Linear(observations, hidden)
        self.fc = nn.Linear(hidden or observations, actions)
        self._has_hidden = bool(hidden)

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        if self._has_hidden:
            observations = torch.tanh(self.hidden(observations))
        return torch.softmax(self.fc(observations), dim=1)

    def layers(self) -> list[nn.Module]:
        """From prepared observations to the preferences, of which `forward` makes probabilities."""
        return [self.hidden, nn.Tanh(), self.fc] if self._has_hidden else [self.fc]

    @property
    def has_hidden(self) -> bool:
        """Whether there is a layer between observation and action."""
        return self._has_hidden

    def log_chances(self, probabilities: torch.Tensor, actions: torch.Tensor) -> torch.Tensor:
        """Logarithms of the probabilities (N,) of actions (N,)."""
        return torch.log(probabilities.gather(1, actions.unsqueeze(1)).squeeze(1))

    def entropy(self, probabilities: torch.Tensor) -> torch.Tensor:
        """The mean one of the policy."""
        # At a probability of 0 its slope is infinite.
        return torch.special.entr(probabilities.clamp_min(SMALLEST_CHANCE)).sum(1).mean()


class Actor(Protocol):
    """Acts by a copy of a network's weights; observations (D,) as the environment gives them."""

    def draw(self, observation: np.ndarray, generator: np.random.Generator) -> Any:
        """An action as it is learned from."""
        ...

    def greedy(self, observation: np.ndarray) -> Any:
        """The most probable action, as the environment takes it."""
        ...


class PairActor:
    """Two actions, no hidden layer: one dot product tells which.

    Args:
        network: without a hidden layer, for two actions.
        factors: that observations are multiplied by, (D,).
    """

    def __init__(self, network: SoftmaxNetwork, factors: np.ndarray) -> None:
        weight = network.fc.weight.detach().numpy()  # (2, D)
        bias = network.fc.bias.detach().numpy()  # (2,)
        self._weight = (weight[1] - weight[0]) * factors
        self._bias = float(bias[1] - bias[0])

    def _first(self, observation: np.ndarray) -> float:
        preference = float(self._weight @ observation) + self._bias
        return 1.0 / (1.0 + math.exp(min(preference, 700.0)))

    def probabilities(self, observation: np.ndarray) -> np.ndarray:
        """Of the actions: (A,), float64."""
        first = self._first(observation)
        return np.array([first, 1.0 - first])

    def draw(self, observation: np.ndarray, generator: np.random.Generator) -> int:
        return 0 if generator.random() < self._first(observation) else 1

    def greedy(self, observation: np.ndarray) -> int:
        return 0 if self._first(observation) >= 0.5 else 1


class SoftmaxActor:
    """Any number of actions, with or without a hidden layer.

    Args:
        network: the one whose weights are copied.
        prepare: what an observation goes through before the network sees it.
    """

    def __init__(
        self, network: SoftmaxNetwork, prepare: Callable[[np.ndarray], np.ndarray]
    ) -> None:
        self._prepare = prepare
        layers = [network.hidden, network.fc] if network.has_hidden else [network.fc]
        self._layers = [
            (layer.weight.detach().numpy().copy(), layer.bias.detach().numpy().copy())
            for layer in layers
        ]

    def _preferences(self, observation: np.ndarray) -> np.ndarray:
        seen = self._prepare(observation)
        for weight, bias in self._layers[:-1]:
            seen = np.tanh(weight @ seen + bias)
        weight, bias = self._layers[-1]
        return np.asarray(weight @ seen + bias, np.float64)

    def probabilities(self, observation: np.ndarray) -> np.ndarray:
        """Of the actions: (A,), float64."""
        preferences = self._preferences(observation)
        weights = np.exp(preferences - preferences.max())
        return weights / weights.sum()

    def draw(self, observation: np.ndarray, generator: np.random.Generator) -> int:
        ends = np.cumsum(self.probabilities(observation))
        return min(int(np.searchsorted(ends, generator.random(), side="right")), len(ends) - 1)

    def greedy(self, observation: np.ndarray) -> int:
        return int(np.argmax(self._preferences(observation)))


SMALLEST_LOG_STD = -4.0  # a policy that draws always the same learns nothing more
HALF_LOG_2_PI = 0.5 * math.log(2.0 * math.pi)


class Bounds(NamedTuple):
    """The smallest and the largest action: two arrays of its shape and type."""

    low: np.ndarray
    high: np.ndarray

    @property
    def middle(self) -> np.ndarray:
        """Of the range, (n,), float32; 0 where it has no ends."""
        low, high = self._ends()
        return (0.5 * (low + high)).ravel().astype(np.float32)

    @property
    def half(self) -> np.ndarray:
        """Half of the range, (n,), float32; 1 where it has no ends."""
        low, high = self._ends()
        return np.where(high > low, 0.5 * (high - low), 1.0).ravel().astype(np.float32)

    def _ends(self) -> tuple[np.ndarray, np.ndarray]:
        """As float64; -1 and 1 where one is missing."""
        has_both = np.isfinite(self.low) & np.isfinite(self.high)
        low, high = (np.where(has_both, end, 0.0).astype(np.float64) for end in self)
        return np.where(has_both, low, -1.0), np.where(has_both, high, 1.0)

    def limited(self, action: np.ndarray) -> np.ndarray:
        """An action (n,) as the environment takes it: within the range, of its shape and type."""
        shaped = action.reshape(self.low.shape).astype(self.low.dtype)
        return np.asarray(np.clip(shaped, self.low, self.high))


class GaussianNetwork(nn.Module):
    """Prepared observation (N, D) to the means (N, n) of the actions, in halves of their range.

    Args:
        observations: D.
        bounds: of the actions.
        hidden: units in a layer of tanh between them; 0: none.
        log_std: logarithm of the deviation that it begins with.
    """

    def __init__(self, observations: int, bounds: Bounds, hidden: int, log_std: float) -> None:
        super().__init__()
        actions = bounds.low.size
        if hidden:
            self.hidden = nn.Linear(observations, hidden)
        self.fc = nn.Linear(hidden or observations, actions)
        self.log_std = nn.Parameter(torch.full((actions,), log_std))
        self.has_hidden = bool(hidden)
        self._middle, self._half = torch.from_numpy(bounds.middle), torch.from_numpy(bounds.half)

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        if self.has_hidden:
            observations = torch.tanh(self.hidden(observations))
        return self.fc(observations)

    def layers(self) -> list[nn.Module]:
        """From prepared observations to the means."""
        return [self.hidden, nn.Tanh(), self.fc] if self.has_hidden else [self.fc]

    def deviations(self) -> torch.Tensor:
        """Logarithms of them, (n,)."""
        return self.log_std.clamp_min(SMALLEST_LOG_STD)

    def log_chances(self, means: torch.Tensor, actions: torch.Tensor) -> torch.Tensor:
        """Logarithms of the densities (N,) of actions (N, n)."""
        log_std = self.deviations()
        distance = ((actions - self._middle) / self._half - means) * torch.exp(-log_std)
        return -(0.5 * distance**2 + log_std + HALF_LOG_2_PI).sum(1)

    def entropy(self, means: torch.Tensor) -> torch.Tensor:
        """The mean one of the policy; the same in every state."""
        return (self.deviations() + HALF_LOG_2_PI + 0.5).sum()


class GaussianActor:
    """Acts by a copy of a network's weights; see `Actor`.

    Args:
        network: the one whose weights are copied.
        bounds: of the actions.
        prepare: what an observation goes through before the network sees it.
    """

    def __init__(
        self,
        network: GaussianNetwork,
        bounds: Bounds,
        prepare: Callable[[np.ndarray], np.ndarray],
    ) -> None:
        self._prepare, self._bounds = prepare, bounds
        layers = [network.hidden, network.fc] if network.has_hidden else [network.fc]
        self._layers = [
            (layer.weight.detach().numpy().copy(), layer.bias.detach().numpy().copy())
            for layer in layers
        ]
        self._middle, self._half = bounds.middle, bounds.half
        self._std = np.exp(network.deviations().detach().numpy())

    def _mean(self, observation: np.ndarray) -> np.ndarray:
        seen = self._prepare(observation)
        for weight, bias in self._layers[:-1]:
            seen = np.tanh(weight @ seen + bias)
        weight, bias = self._layers[-1]
        return np.asarray(weight @ seen + bias)

    def draw(self, observation: np.ndarray, generator: np.random.Generator) -> np.ndarray:
        """An action (n,), float32; it may lie beyond its range."""
        noise = generator.standard_normal(len(self._std), np.float32)
        return self._middle + self._half * (self._mean(observation) + self._std * noise)

    def greedy(self, observation: np.ndarray) -> np.ndarray:
        """The mean action, within its range."""
        return self._bounds.limited(self._middle + self._half * self._mean(observation))
