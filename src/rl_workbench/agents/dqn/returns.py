"""n-step returns: single steps in, transitions over n steps out."""

from collections import deque
from typing import Any

import numpy as np
import torch

from rl_workbench.agents.dqn.replay import Transition
from rl_workbench.states import array, number, sequence, whole


class NStepReturns:
    """Turns an episode's steps into transitions over n steps, fewer at the episode's end.

    Args:
        steps: n; with 1 each step is a transition.
        gamma: the discount factor.
    """

    def __init__(self, steps: int, gamma: float) -> None:
        self._steps = steps
        self._gamma = gamma
        self._window: deque[tuple[np.ndarray, int, float]] = deque()

    def add(
        self, step: tuple[np.ndarray, int, float], following: np.ndarray, ended: bool, valued: bool
    ) -> list[Transition]:
        """Takes one step; returns the transitions that are complete now.

        Args:
            step: observation before the action, action, reward.
            following: the observation after it.
            ended: the episode is over: terminated or truncated.
            valued: the following observation's value counts; it doesn't after a termination.
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
        """Forgets the steps of an episode that isn't continued."""
        self._window.clear()

    def state_dict(self) -> dict[str, Any]:
        """The steps that wait for their successors."""
        return {
            "observations": [torch.from_numpy(step[0].copy()) for step in self._window],
            "actions": [step[1] for step in self._window],
            "rewards": [step[2] for step in self._window],
        }

    def load_state_dict(self, state: dict[str, Any], size: int, actions: int) -> None:
        """Takes over what `state_dict` gave.

        Args:
            size: D, of observations.
            actions: A.
        """
        observations = [
            array(each, torch.float32, (size,)) for each in sequence(state["observations"])
        ]
        chosen = [whole(each) for each in sequence(state["actions"], len(observations))]
        if max(chosen, default=0) >= actions:
            raise ValueError(f"action {max(chosen)} of {actions}")
        rewards = [number(each) for each in sequence(state["rewards"], len(observations))]
        if len(observations) >= max(self._steps, 1):
            raise ValueError(f"{len(observations)} steps wait for {self._steps}-step returns")
        self._window = deque(zip(observations, chosen, rewards, strict=True))
