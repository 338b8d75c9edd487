"""One episode with a policy's random choice of actions: step by step, or whole."""

from collections.abc import Callable, Generator
from typing import Any

import gymnasium
import numpy as np

from rl_workbench.agents.pg.document import Episode
from rl_workbench.training.environments.answers import as_vector, succeeded


def play(
    env: gymnasium.Env[Any, Any],
    act: Callable[[np.ndarray], Any],
    limited: Callable[[Any], Any] = lambda action: action,
    begin: Callable[[Any], object] = lambda action: None,
) -> Generator[None, None, Episode]:
    """Plays one episode; stops before each step, so that others can be played meanwhile.

    Args:
        env: was seeded before.
        act: draws an action for an observation (D,), float32.
        limited: makes of an action that was drawn the one that the environment takes.
        begin: has the step by such an action begin, before this stops.

    Returns:
        The episode.
    """
    episode = Episode()
    observation = as_vector(env.reset()[0])
    finished = False
    while not finished:
        action = act(observation)
        taken = limited(action)
        begin(taken)
        yield
        following, reward, terminated, truncated, info = env.step(taken)
        episode.add(observation, action, float(reward))
        observation = as_vector(following)
        finished = terminated or truncated
    episode.final_observation, episode.terminated = observation, bool(terminated)
    episode.success = succeeded(info)
    return episode


def play_all(
    playing: list[Generator[None, None, Episode]], should_stop: Callable[[], bool]
) -> list[Episode] | None:
    """Plays several episodes at the same time, a step of each in turn, until all have ended.

    Args:
        playing: what `play` gave, of environments of their own.
        should_stop: is asked before each step.

    Returns:
        The episodes, in their order, or None if they were broken off because `should_stop()` became true.
    """
    episodes: dict[int, Episode] = {}
    for each in playing:
        next(each)  # a policy acts at least once
    while len(episodes) < len(playing):
        for index, each in enumerate(playing):
            if index in episodes:
                continue
            if should_stop():
                return None
            try:
                next(each)
            except StopIteration as end:
                episodes[index] = end.value
    return [episodes[index] for index in range(len(playing))]


def run_episode(
    env: gymnasium.Env[Any, Any],
    act: Callable[[np.ndarray], Any],
    should_stop: Callable[[], bool],
    limited: Callable[[Any], Any] = lambda action: action,
) -> Episode | None:
    """Runs one episode alone; see `play` and `play_all`."""
    episodes = play_all([play(env, act, limited)], should_stop)
    return None if episodes is None else episodes[0]
