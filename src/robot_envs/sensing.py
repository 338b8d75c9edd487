"""Imperfect sensors: what is measured is noisy and late; reward and end go by the truth."""

import math
from collections import deque
from collections.abc import Sequence
from typing import Generic

import numpy as np

from robot_envs.robot import Robot, State

MOST_DELAY = 1000  # [control steps]


class Sensor(Generic[State]):
    """Measures a robot's state.

    Args:
        robot: whose state.
        noise: standard deviation of the normal noise on each of the state's numbers
            [m, m/s, rad, rad/s]; a single number goes for all of them.
        delay: how many control steps old a measurement is. Before there are any so old, it is
            the one of the episode's start.

    Raises:
        ValueError: if the noise is negative or not finite, or the delay no number of steps.
    """

    def __init__(
        self,
        robot: Robot[State],
        noise: float | Sequence[float] | np.ndarray = 0.0,
        delay: int = 0,
    ) -> None:
        self._state_of = robot.state_of
        self._count = 2 * len(robot.joints)
        sizes = tuple(np.ravel(noise).tolist()) * (1 if np.ndim(noise) else self._count)
        fits = len(sizes) == self._count
        if not fits or not all(math.isfinite(size) and size >= 0.0 for size in sizes):
            raise ValueError(f"sensor noise must be one or {self._count} numbers >= 0, not {noise}")
        if not 0 <= delay <= MOST_DELAY or delay != int(delay):
            raise ValueError(f"sensor delay must lie in [0, {MOST_DELAY}] steps, not {delay}")
        self._noise = sizes
        self.is_noisy = any(sizes)
        self.is_exact = not self.is_noisy and delay == 0
        self._seen: deque[State] = deque(maxlen=int(delay) + 1)

    def begin(self, state: State, rng: np.random.Generator) -> State:
        """Returns the first measurement of an episode that starts in `state`."""
        self._seen.clear()
        return self.measure(state, rng)

    def measure(self, state: State, rng: np.random.Generator) -> State:
        """Returns the measurement that arrives when the robot is in `state`."""
        self._seen.append(self._noisy(state, rng) if self.is_noisy else state)
        return self._seen[0]

    def _noisy(self, state: State, rng: np.random.Generator) -> State:
        errors = rng.standard_normal(self._count).tolist()
        sized = zip(state, self._noise, errors, strict=True)
        return self._state_of([value + size * error for value, size, error in sized])
