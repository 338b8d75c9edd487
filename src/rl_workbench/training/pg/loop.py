"""The policy-gradient loop: run an episode, learn from it, report."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import gymnasium
import numpy as np

from rl_workbench.agents.pg.document import Episode, Losses
from rl_workbench.training.run.history import History

WINDOW = 20  # [episodes] over which a mean length counts


@dataclass(frozen=True)
class EpisodeRecord:
    """One finished episode."""

    index: int
    length: int  # [steps]
    total_reward: float
    losses: Losses | None  # None: nothing was learned yet, its batch isn't full
    steps_per_second: float  # mean since the training began or was resumed, learning included
    steps: int  # of the whole training, this episode included


class Learner(Protocol):
    """What acts, and learns from whole episodes."""

    def act(self, observation: np.ndarray) -> int: ...

    def learn(self, episode: Episode) -> Losses | None: ...


class Observer(Protocol):
    """Is told of every finished episode: a logger, a progress bar, what saves and evaluates."""

    def episode_done(self, record: EpisodeRecord) -> None: ...


def run_episode(
    env: gymnasium.Env[Any, Any], agent: Learner, should_stop: Callable[[], bool]
) -> Episode | None:
    """Runs one episode with the agent's own, random choice of actions.

    Returns:
        The episode, or None if it was broken off because `should_stop()` became true.
    """
    episode = Episode()
    observation = _vector(env.reset()[0])
    finished = False
    while not finished:
        if should_stop():
            return None
        action = agent.act(observation)
        following, reward, terminated, truncated, _ = env.step(action)
        episode.add(observation, action, float(reward))
        observation = _vector(following)
        finished = terminated or truncated
    episode.final_observation, episode.terminated = observation, bool(terminated)
    return episode


def _vector(observation: Any) -> np.ndarray:
    """A copy: an environment may well write into the array that it returned."""
    return np.array(observation, dtype=np.float32)


class _Book:
    """Enters episodes into the history, with the time they took."""

    def __init__(self, history: History) -> None:
        self._history = history
        self._began, self._seconds_before = time.monotonic(), history.seconds
        self._steps = self._steps_before = history.steps

    def add(self, episode: Episode, losses: Losses | None) -> EpisodeRecord:
        history = self._history
        history.lengths.append(episode.length)
        history.returns.append(episode.total_reward)
        self._steps += episode.length
        elapsed = max(time.monotonic() - self._began, 1e-9)
        history.seconds = self._seconds_before + elapsed
        return EpisodeRecord(
            len(history.lengths) - 1,
            episode.length,
            episode.total_reward,
            losses,
            (self._steps - self._steps_before) / elapsed,
            self._steps,
        )


def train(
    env: gymnasium.Env[Any, Any],
    agent: Learner,
    episodes: int,
    history: History,
    observers: list[Observer],
    should_stop: Callable[[], bool] = lambda: False,
    stop_at: float = 0.0,
) -> None:
    """Trains until it is complete, or `should_stop()`; an episode broken off is dropped.

    Args:
        episodes: of the whole training; those in `history` count.
        stop_at: the mean length [steps] of the last 20 episodes with which it is done; 0: none.

    Raises:
        WorkbenchError: if the environment or the arithmetic fails; `history` and `agent` hold
            what was learned.
    """
    book = _Book(history)
    while not is_complete(history, episodes, stop_at):
        episode = run_episode(env, agent, should_stop)
        if episode is None:
            return
        record = book.add(episode, agent.learn(episode))
        for observer in observers:
            observer.episode_done(record)


def is_complete(history: History, episodes: int, stop_at: float) -> bool:
    """Whether all episodes were run, or the last 20 lasted long enough."""
    recent = history.lengths[-WINDOW:]
    solved = bool(stop_at) and len(recent) == WINDOW and sum(recent) >= stop_at * WINDOW
    return solved or len(history.lengths) >= episodes
