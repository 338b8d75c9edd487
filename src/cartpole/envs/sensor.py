"""Imperfect sensors: what is measured is noisy and late; reward and end go by the truth."""

import math
from collections import deque
from collections.abc import Sequence

import numpy as np

from cartpole.task import CartPoleState

MOST_DELAY = 1000  # [control steps]


class Sensor:
    """Measures the robot's state.

    Args:
        noise: standard deviation of the normal noise on each of the state's four numbers
            [m, m/s, rad, rad/s]; a single number goes for all four.
        delay: how many control steps old a measurement is. Before there are any so old, it is
            the one of the episode's start.

    Raises:
        ValueError: if the noise is negative or not finite, or the delay no number of steps.
    """

    def __init__(self, noise: float | Sequence[float] | np.ndarray = 0.0, delay: int = 0) -> None:
        sizes = tuple(np.ravel(noise).tolist()) * (1 if np.ndim(noise) else 4)
        if len(sizes) != 4 or not all(math.isfinite(size) and size >= 0.0 for size in sizes):
            raise ValueError(f"sensor noise must be one or four numbers >= 0, not {noise}")
        if not 0 <= delay <= MOST_DELAY or delay != int(delay):
            raise ValueError(f"sensor delay must lie in [0, {MOST_DELAY}] steps, not {delay}")
        self._noise = sizes
        self.is_noisy = any(sizes)
        self._seen: deque[CartPoleState] = deque(maxlen=int(delay) + 1)

    def begin(self, state: CartPoleState, rng: np.random.Generator) -> CartPoleState:
        """Returns the first measurement of an episode that starts in `state`."""
        self._seen.clear()
        return self.measure(state, rng)

    def measure(self, state: CartPoleState, rng: np.random.Generator) -> CartPoleState:
        """Returns the measurement that arrives when the robot is in `state`."""
        self._seen.append(self._noisy(state, rng) if self.is_noisy else state)
        return self._seen[0]

    def _noisy(self, state: CartPoleState, rng: np.random.Generator) -> CartPoleState:
        errors = rng.standard_normal(4).tolist()
        return CartPoleState(
            *(
                value + size * error
                for value, size, error in zip(state, self._noise, errors, strict=True)
            )
        )
