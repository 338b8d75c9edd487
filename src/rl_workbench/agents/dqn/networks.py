"""The Q-networks, and a quick way to ask them for one observation."""

from collections.abc import Callable, Sequence

import numpy as np
import torch
from torch import nn


def _hidden(sizes: Sequence[int]) -> list[nn.Module]:
    layers: list[nn.Module] = []
    for inputs, outputs in zip(sizes, sizes[1:], strict=False):
        layers += [nn.Linear(inputs, outputs), nn.ReLU()]
    return layers


class QNetwork(nn.Module):
    """Observations (N, D) to the value of each action (N, A)."""

    def __init__(self, observation_size: int, actions: int, hidden: Sequence[int]) -> None:
        super().__init__()
        layers = _hidden([observation_size, *hidden])
        self.net = nn.Sequential(*layers, nn.Linear(hidden[-1], actions))

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        values: torch.Tensor = self.net(observations)
        return values


class DuelingQNetwork(nn.Module):
    """As QNetwork, by the state's value and each action's advantage: Q = V + A - mean(A)."""

    def __init__(self, observation_size: int, actions: int, hidden: Sequence[int]) -> None:
        super().__init__()
        self.feature = nn.Sequential(*_hidden([observation_size, *hidden]))
        self.value = nn.Linear(hidden[-1], 1)
        self.advantage = nn.Linear(hidden[-1], actions)

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        features = self.feature(observations)
        advantage = self.advantage(features)
        values: torch.Tensor = self.value(features) + advantage
        return values - advantage.mean(dim=1, keepdim=True)


def fast_values(network: nn.Module) -> Callable[[np.ndarray], np.ndarray]:
    """The network as a function of one observation (D,), several times as fast as torch.

    It reads the network's own memory, so it follows every change of the weights. What it
    returns, (A,), has the same order as the Q-values: a dueling network's lack V - mean(A).
    """
    body = network.feature if isinstance(network, DuelingQNetwork) else network.net
    head = [network.advantage] if isinstance(network, DuelingQNetwork) else []
    linear = [layer for layer in [*_layers(body), *head] if isinstance(layer, nn.Linear)]
    pairs = [(layer.weight.detach().numpy(), layer.bias.detach().numpy()) for layer in linear]
    *hidden, (weight, bias) = pairs

    def values(observation: np.ndarray) -> np.ndarray:
        for matrix, offset in hidden:
            observation = matrix @ observation
            observation += offset
            np.maximum(observation, 0.0, out=observation)
        result: np.ndarray = weight @ observation
        result += bias
        return result

    return values


def _layers(body: object) -> list[nn.Module]:
    return list(body) if isinstance(body, nn.Sequential) else []


class FlatParameters:
    """A network's parameters moved into one vector, and their gradients into another.

    The network works as before; but the optimiser, the clipping of gradients and the target
    update handle one tensor instead of one for each layer, which halves the time of a gradient
    step of a small network.
    """

    def __init__(self, network: nn.Module) -> None:
        parameters = list(network.parameters())
        vector = torch.cat([parameter.detach().reshape(-1) for parameter in parameters])
        self.vector = nn.Parameter(vector)
        self.gradient = torch.zeros_like(vector)
        self.vector.grad = self.gradient
        start = 0
        for parameter in parameters:
            piece = slice(start, start + parameter.numel())
            parameter.data = vector[piece].view_as(parameter)
            parameter.grad = self.gradient[piece].view_as(parameter)
            start = piece.stop

    @torch.no_grad()
    def follow(self, other: "FlatParameters", share: float) -> None:
        """Moves this network towards another one by a share of the way; 1 copies it."""
        if share == 1.0:
            self.vector.copy_(other.vector)
        else:
            self.vector.lerp_(other.vector, share)
