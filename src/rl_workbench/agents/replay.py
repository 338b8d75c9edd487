"""The replay buffer: transitions in preallocated arrays, drawn uniformly."""

from collections import deque
from typing import Any, NamedTuple

import numpy as np
import torch

from rl_workbench.errors import WorkbenchError


class Transition(NamedTuple):
    """One step, or n, for the target of Q(observation, action)."""

    observation: np.ndarray  # (D,) float32
    action: int
    reward: float  # the discounted sum over n steps
    next_observation: np.ndarray  # (D,) float32
    discount: float


class Batch(NamedTuple):
    """Transitions as arrays, for K gradient steps of B transitions each."""

    observations: np.ndarray  # (K, B, D) float32
    actions: np.ndarray  # (K, B) int64
    rewards: np.ndarray  # (K, B) float32
    next_observations: np.ndarray  # (K, B, D) float32
    discounts: np.ndarray  # (K, B) float32


class ReplayBuffer:
    """Keeps the newest `capacity` transitions; memory that is only reserved takes no RAM until it fills."""

    def __init__(self, capacity: int, observation_size: int) -> None:
        shape = (capacity, observation_size)
        try:
            self._columns = Batch(
                np.zeros(shape, np.float32),
                np.zeros(capacity, np.int64),
                np.zeros(capacity, np.float32),
                np.zeros(shape, np.float32),
                np.zeros(capacity, np.float32),
            )
        except MemoryError as error:
            raise WorkbenchError(
                f"no memory for {capacity} transitions; take a smaller buffer_size"
            ) from error
        self.capacity = capacity
        self._size = 0
        self._next = 0  # where the next transition goes

    def __len__(self) -> int:
        return self._size

    def push(self, transition: Transition) -> None:
        """Adds a transition; in a full buffer it replaces the oldest."""
        index = self._next
        for column, value in zip(self._columns, transition, strict=True):
            column[index] = value
        self._next = (index + 1) % self.capacity
        self._size = max(self._size, index + 1)

    def sample(self, batch_size: int, rng: np.random.Generator, rounds: int = 1) -> Batch:
        """Draws `rounds` batches, each without replacement, of all transitions if these are fewer."""
        count = min(batch_size, self._size)
        if count == self._size:
            indices = np.tile(np.arange(count), (rounds, 1))
        else:
            indices = np.empty((rounds, count), np.int64)
            for row in indices:
                row[:] = rng.choice(self._size, count, replace=False, shuffle=False)
        return Batch(*(column[indices] for column in self._columns))

    def state_dict(self) -> dict[str, Any]:
        """Returns the filled part as tensors that share its memory, and the next position."""
        columns = self._columns._asdict().items()
        arrays = {name: torch.from_numpy(column[: self._size]) for name, column in columns}
        return {**arrays, "next": self._next}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Loads what `state_dict` returned."""
        size, following = len(state["actions"]), int(state["next"])
        is_full = size == self.capacity
        if size > self.capacity or not (following < size if is_full else following == size):
            raise WorkbenchError(f"a buffer of {self.capacity} can't hold {size} transitions")
        for name, column in self._columns._asdict().items():
            column[:size] = state[name].numpy()
        self._size, self._next = size, following


class NStepReturns:
    """Combines an episode's steps into n-step transitions, shorter ones at the episode's end."""

    def __init__(self, steps: int, gamma: float) -> None:
        self._steps = steps
        self._gamma = gamma
        self._window: deque[tuple[np.ndarray, int, float]] = deque()

    def add(
        self, step: tuple[np.ndarray, int, float], following: np.ndarray, ended: bool, valued: bool
    ) -> list[Transition]:
        """Adds a step (observation, action, reward); returns the transitions that it completes.

        `following` is the observation after it, whose value counts if `valued`: not after a termination.
        """
        self._window.append(step)
        transitions = []
        if len(self._window) == self._steps or ended:
            transitions.append(self._oldest(following, valued))
        while ended and self._window:
            transitions.append(self._oldest(following, valued))
        return transitions

    def _oldest(self, following: np.ndarray, valued: bool) -> Transition:
        reward, discount = 0.0, 1.0
        for _, _, later in self._window:
            reward += discount * later
            discount *= self._gamma
        observation, action, _ = self._window.popleft()
        return Transition(observation, action, reward, following, discount if valued else 0.0)

    def clear(self) -> None:
        """Discards the pending steps of an abandoned episode."""
        self._window.clear()

    def state_dict(self) -> dict[str, Any]:
        """Returns the pending steps, whose n rewards aren't known yet."""
        return {
            "observations": [torch.from_numpy(step[0].copy()) for step in self._window],
            "actions": [step[1] for step in self._window],
            "rewards": [step[2] for step in self._window],
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Loads what `state_dict` returned."""
        observations = [each.numpy().copy() for each in state["observations"]]
        self._window = deque(zip(observations, state["actions"], state["rewards"], strict=True))
