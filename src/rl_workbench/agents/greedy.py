"""Greedy policies as torch modules that TorchScript can compile, without the agent that learned them."""

import numpy as np
import torch
from torch import nn


class Scaling(nn.Module):
    """Scales observations (N, D): (x - offset) * factors, both (D,) float32, clipped to +-limit."""

    offset: torch.Tensor
    factors: torch.Tensor

    def __init__(self, offset: np.ndarray, factors: np.ndarray, limit: float = float("inf")) -> None:
        super().__init__()
        self.register_buffer("offset", torch.from_numpy(offset.copy()))
        self.register_buffer("factors", torch.from_numpy(factors.copy()))
        self.limit = limit

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        return torch.clamp((observations - self.offset) * self.factors, -self.limit, self.limit)


class Spread(nn.Module):
    """Converts actions (N, n) in half-ranges from the middle of their range, (n,) float32, to their units."""

    middle: torch.Tensor
    reach: torch.Tensor

    def __init__(self, middle: np.ndarray, half: np.ndarray) -> None:
        super().__init__()
        self.register_buffer("middle", torch.from_numpy(middle.copy()))
        self.register_buffer("reach", torch.from_numpy(half.copy()))

    def forward(self, actions: torch.Tensor) -> torch.Tensor:
        return self.middle + self.reach * actions


class Continuous(nn.Module):
    """Maps observations (N, D) by `outputs` (N, n) to continuous actions, in their space's shape and type."""

    low: torch.Tensor
    high: torch.Tensor

    def __init__(self, outputs: nn.Module, low: np.ndarray, high: np.ndarray) -> None:
        super().__init__()
        self.outputs = outputs
        self.shape: list[int] = [-1, *low.shape]
        self.register_buffer("low", torch.from_numpy(low.copy()))
        self.register_buffer("high", torch.from_numpy(high.copy()))


class ClippedAction(Continuous):
    """Clips the outputs to the bounds."""

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        return torch.clamp(self.outputs(observations).reshape(self.shape), self.low, self.high)


class Choice(nn.Module):
    """Maps observations (N, D), float32, to actions, by what maps them to scores (N, A), on any scale."""

    def __init__(self, scores: nn.Module) -> None:
        super().__init__()
        self.scores = scores


class SingleChoice(Choice):
    """Chooses the action with the highest score, (N,)."""

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        return self.scores(observations).argmax(dim=1)


class SeveralChoices(Choice):
    """Chooses the action with the highest score in each group of scores, (N, groups), of these sizes."""

    def __init__(self, scores: nn.Module, sizes: list[int]) -> None:
        super().__init__(scores)
        self.sizes: list[int] = sizes

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        groups = self.scores(observations).split(self.sizes, dim=1)
        return torch.stack([group.argmax(dim=1) for group in groups], dim=1)


class Switches(Choice):
    """Whether each score is positive: 0 or 1, (N, A)."""

    def forward(self, observations: torch.Tensor) -> torch.Tensor:
        return (self.scores(observations) > 0.0).long()
