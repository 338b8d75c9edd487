"""Normalisation of observations by their running mean and standard deviation."""

from typing import Any

import numpy as np
import torch

from rl_workbench.agents.greedy import Scaling

CLIP = 10.0  # [standard deviations]
SMALLEST = 1e-8  # added to the variance, so that a constant quantity gives 0


class Normaliser:
    """Running mean and variance of each quantity (Welford's way)."""

    def __init__(self, size: int) -> None:
        self._count = 0
        self._mean = np.zeros(size)
        self._squares = np.zeros(size)  # sum of squared deviations
        self._update_scale()

    def add(self, observation: np.ndarray) -> None:
        """Updates mean and variance with one observation (D,)."""
        self._count += 1
        deviation = observation - self._mean
        self._mean += deviation / self._count
        self._squares += deviation * (observation - self._mean)
        self._update_scale()

    def _update_scale(self) -> None:
        variance = self._squares / self._count if self._count > 1 else np.ones_like(self._squares)
        self._offset = self._mean.astype(np.float32)
        self._scale = (1.0 / np.sqrt(variance + SMALLEST)).astype(np.float32)

    def __call__(self, observations: np.ndarray) -> np.ndarray:
        """Returns observations (..., D) in standard deviations from the mean, float32, within +-10."""
        scaled: np.ndarray = (observations - self._offset) * self._scale
        return np.clip(scaled, -CLIP, CLIP)

    def network(self) -> Scaling:
        """Returns the present scaling as a torch module; later updates don't change it."""
        return Scaling(self._offset, self._scale, CLIP)

    def state_dict(self) -> dict[str, Any]:
        """Returns count, mean and sum of squares."""
        return {
            "count": self._count,
            "mean": torch.from_numpy(self._mean.copy()),
            "squares": torch.from_numpy(self._squares.copy()),
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Loads what `state_dict` returned."""
        self._count = int(state["count"])
        self._mean = state["mean"].numpy().copy()
        self._squares = state["squares"].numpy().copy()
        self._update_scale()
