"""Greedy evaluation: how long the learned policy balances when it stops exploring."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np

# The simulator repeats itself: from the upright state a greedy policy would run the same
# episode 20 times. So each starts from its own seeded position [m] and angle [rad] within this.
NOISE = 0.02


@dataclass(frozen=True)
class Evaluation:
    """Lengths [steps] and undiscounted returns, one for each episode."""

    lengths: list[int]
    returns: list[float]

    @property
    def mean_length(self) -> float:
        return float(np.mean(self.lengths))

    @property
    def mean_return(self) -> float:
        return float(np.mean(self.returns))


def run_greedily(
    env: gymnasium.Env[Any, Any],
    act: Callable[[np.ndarray], int],
    seed: int,
    episodes: int,
    should_stop: Callable[[], bool] = lambda: False,
) -> Evaluation | None:
    """Runs episodes in any environment, seeded once; None if told to stop."""
    lengths, returns = [], []
    for index in range(episodes):
        observation, _ = env.reset(seed=seed if index == 0 else None)
        length, total, finished = 0, 0.0, False
        while not finished:
            if should_stop():
                return None
            observation, reward, terminated, truncated, _ = env.step(
                act(np.asarray(observation, np.float32))
            )
            length, total = length + 1, total + float(reward)
            finished = terminated or truncated
        lengths.append(length)
        returns.append(total)
    return Evaluation(lengths, returns)
