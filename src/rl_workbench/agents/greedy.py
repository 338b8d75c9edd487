"""What a policy comes to without whoever learned it: torch modules from observations to greedy actions.

All of it can be compiled by TorchScript. The agents act by quicker ways of their own, for one observation.
"""

from abc import ABC, abstractmethod

import numpy as np
import torch
from torch import nn


class Scaling(nn.Module):
    """Observations (N, D) as a network has learned to see them.

    Args:
        offset: is subtracted first, (D,) float32.
        factors: what is left is multiplied by, (D,) float32.
        limit: what is beyond +-limit is clipped.
    """

    offset: torch.Tensor
    factors: torch.Tensor

    def __init__(
        self, offset: np.ndarray, factors: np.ndarray, limit: float = float("inf")
    ) -> None:
        super().__init__()
        self.register_buffer("offset", torch.from_numpy(offset.copy()))
        self.register_buffer("factors", torch.from_numpy(factors.copy()))
        self.limit = limit

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        return torch.clamp((observations - self.offset) * self.factors, -self.limit, self.limit)


class Spread(nn.Module):
    """Actions (N, n), told in halves of their range from its middle on, in their own units.

    Args:
        middle: (n,) float32.
        half: (n,) float32.
    """

    middle: torch.Tensor
    reach: torch.Tensor

    def __init__(self, middle: np.ndarray, half: np.ndarray) -> None:
        super().__init__()
        self.register_buffer("middle", torch.from_numpy(middle.copy()))
        self.register_buffer("reach", torch.from_numpy(half.copy()))

    def forward(self, actions: torch.Tensor) -> torch.Tensor:
        return self.middle + self.reach * actions


class Continuous(nn.Module):
    """Observations (N, D) to continuous actions, in their shape and type.

    Args:
        outputs: observations to numbers (N, n).
        low: the smallest action, of its shape and type.
        high: the largest one.
    """

    low: torch.Tensor
    high: torch.Tensor

    def __init__(self, outputs: nn.Module, low: np.ndarray, high: np.ndarray) -> None:
        super().__init__()
        self.outputs = outputs
        self.shape: list[int] = [-1, *low.shape]
        self.register_buffer("low", torch.from_numpy(low.copy()))
        self.register_buffer("high", torch.from_numpy(high.copy()))


class ClippedAction(Continuous):
    """The outputs, within the bounds."""

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        return torch.clamp(self.outputs(observations).reshape(self.shape), self.low, self.high)


class Choice(nn.Module, ABC):
    """Observations (N, D), float32, to what the highest of the scores choose.

    Args:
        scores: observations to numbers of any kind, (N, A).
    """

    def __init__(self, scores: nn.Module) -> None:
        super().__init__()
        self.scores = scores

    @abstractmethod
    def margins(self, observations: torch.Tensor) -> torch.Tensor:
        """How clear each choice is, (N,): by how much the score that wins is higher than the next one.

        It is a share of the larger of the two, or of 1; below what rounding makes, another order of the same
        sums may choose otherwise.
        """


class SingleChoice(Choice):
    """The action of the highest score, (N,)."""

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        return self.scores(observations).argmax(dim=1)

    def margins(self, observations: torch.Tensor) -> torch.Tensor:
        return lead(self.scores(observations))


def lead(scores: torch.Tensor) -> torch.Tensor:
    """By how much the highest of (N, A) is above the next one, see `Choice.margins`: (N,)."""
    if scores.shape[1] == 1:
        return torch.full((len(scores),), float("inf"))
    first, second = scores.topk(2, dim=1).values.unbind(dim=1)
    return (first - second) / torch.maximum(first.abs(), second.abs()).clamp_min(1.0)
