"""One episode with a policy's random choice of actions, and the way back from a broken-off one."""

import json
import random
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
import torch

from rl_workbench.agents.pg.document import Episode
from rl_workbench.training.environments.answers import as_vector, succeeded


def run_episode(
    env: gymnasium.Env[Any, Any],
    act: Callable[[np.ndarray], Any],
    should_stop: Callable[[], bool],
    limited: Callable[[Any], Any] = lambda action: action,
) -> Episode | None:
    """Runs one episode.

    Args:
        env: was seeded before.
        act: draws an action for an observation (D,), float32.
        should_stop: is asked before each step.
        limited: makes of an action that was drawn the one that the environment takes.

    Returns:
        The episode, or None if it was broken off because `should_stop()` became true.
    """
    episode = Episode()
    observation = as_vector(env.reset()[0])
    finished = False
    while not finished:
        if should_stop():
            return None
        action = act(observation)
        following, reward, terminated, truncated, info = env.step(limited(action))
        episode.add(observation, action, float(reward))
        observation = as_vector(following)
        finished = terminated or truncated
    episode.final_observation, episode.terminated = observation, bool(terminated)
    episode.success = succeeded(info)
    return episode


class EpisodeGenerators:
    """All generators that an episode draws from: the process's, the environment's, the agent's.

    An episode that is broken off has drawn from them, but nothing was learned from it: `rewind`
    takes its draws back, so that it can be run again as it would have been.

    Args:
        environment: has a generator once it was seeded.
        agent: its own generator.
    """

    def __init__(self, environment: gymnasium.Env[Any, Any], agent: np.random.Generator) -> None:
        self._environment, self._agent = environment.unwrapped, agent

    def _own(self) -> tuple[Any, Any]:
        """The environment's, which is another one after each seeding, and the agent's."""
        return self._environment.np_random.bit_generator, self._agent.bit_generator

    def mark(self) -> None:
        """Remembers where they all are."""
        self._process: Any = (
            random.getstate(), np.random.get_state(legacy=False), torch.get_rng_state()
        )  # fmt: skip
        self._states = [each.state for each in self._own()]

    def rewind(self) -> None:
        """Brings them back to where `mark` found them."""
        python, numpy, tensor = self._process
        random.setstate(python)
        np.random.set_state(numpy)
        torch.set_rng_state(tensor)
        for generator, state in zip(self._own(), self._states, strict=True):
            generator.state = state

    @property
    def environment(self) -> str:
        """The environment's, as JSON; some hold arrays."""
        return json.dumps(self._own()[0].state, default=lambda array: array.tolist())

    @environment.setter
    def environment(self, text: str) -> None:
        self._own()[0].state = json.loads(text)
