"""A Gaussian policy over continuous actions: the network that learns, and its quick twin that acts.

The means are linear in the observation, or of one hidden layer, the deviations the same everywhere. Both are
in units of half of the action's range, from its middle on: so one learning rate suits joints of any range.
Actions that are drawn beyond the range are learned from as they are, and clipped for the environment.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import torch
from torch import nn

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
