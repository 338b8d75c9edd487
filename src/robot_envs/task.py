"""What is to be learned: observation, reward, end of an episode, initial state, and what an action does.

Knows neither ROS nor a simulator nor a learner; every backend runs the same tasks.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any, ClassVar, Generic

import gymnasium
import numpy as np

from robot_envs.robot import State

Command = tuple[float, ...]
"""A number for each controller that is commanded, in the robot's order [m, rad, m/s, rad/s, N, N m]."""


class Task(ABC, Generic[State]):
    """One thing to learn on a robot whose joints a `State` tells.

    Args:
        noise: half-width of what is drawn uniformly for the initial state; 0 starts every episode
            alike.
        max_steps: length at which an episode is cut off.

    Raises:
        ValueError: if noise or max_steps make no sense.
    """

    height: ClassVar[float] = 0.0  # [m] above the ground, for the robot to clear it
    start: State  # of an episode without noise

    def __init__(self, noise: float, max_steps: int) -> None:
        if not 0.0 <= noise < math.inf:
            raise ValueError(f"noise must be at least 0 and finite, not {noise}")
        if max_steps < 1:
            raise ValueError(f"max_steps must be at least 1, not {max_steps}")
        self.noise = noise
        self.max_steps = max_steps

    @abstractmethod
    def action_space(self) -> gymnasium.Space[Any]:
        """A new space of the actions."""

    @abstractmethod
    def observation_space(self) -> gymnasium.spaces.Box:
        """A new space of the observations."""

    def initial_state(self, rng: np.random.Generator) -> State:
        """Draws where an episode starts: `start`, and up to `noise` [m, m/s, rad, rad/s] off it."""
        make: Callable[..., State] = type(self.start)
        offsets = rng.uniform(-self.noise, self.noise, size=len(self.start))
        return make(
            *(float(value + offset) for value, offset in zip(self.start, offsets, strict=True))
        )

    @abstractmethod
    def initial_command(self, state: State) -> Command:
        """What the controllers hold when an episode starts in a state."""

    @abstractmethod
    def next_command(self, command: Command, action: Any) -> Command:
        """What an action makes of the command before it; ValueError if it is none."""

    @abstractmethod
    def observation(self, state: State) -> np.ndarray:
        """The state as the learner sees it; a new array."""

    @abstractmethod
    def is_terminal(self, state: State) -> bool:
        """Whether the state ends the episode."""

    def is_truncated(self, steps: int) -> bool:
        """Whether an episode of that many steps is cut off."""
        return steps >= self.max_steps

    @abstractmethod
    def reward(self, state: State) -> float:
        """The reward for arriving in a state."""
