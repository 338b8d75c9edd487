"""The training loop: run an episode, learn from it, report, save."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from torch import nn

from cartpole.agents.policy_gradient import Episode, Losses
from cartpole.envs.cartpole_env import CartPoleEnv

WINDOW = 20  # [episodes] over which a mean length counts


@dataclass(frozen=True)
class EpisodeRecord:
    """One line of the training's history."""

    index: int
    length: int  # [steps]
    total_reward: float
    losses: Losses
    steps_per_second: float  # mean since the training began, learning included


@dataclass
class History:
    """What the training has seen so far; complete also when it ends early."""

    episodes: list[EpisodeRecord] = field(default_factory=list)
    steps: int = 0
    _started: float = field(default_factory=time.monotonic)  # [s]
    seconds: float = 0.0  # wall time from the beginning to the last finished episode

    def add(self, index: int, episode: Episode, losses: Losses) -> EpisodeRecord:
        self.steps += episode.length
        self.seconds = max(time.monotonic() - self._started, 1e-9)
        record = EpisodeRecord(
            index, episode.length, episode.total_reward, losses, self.steps / self.seconds
        )
        self.episodes.append(record)
        return record

    def is_solved(self, length: float) -> bool:
        """Whether the last 20 episodes lasted that long on average."""
        recent = self.lengths[-WINDOW:]
        return len(recent) == WINDOW and sum(recent) >= length * WINDOW

    @property
    def lengths(self) -> list[int]:
        return [record.length for record in self.episodes]

    @property
    def returns(self) -> list[float]:
        return [record.total_reward for record in self.episodes]


class Agent(Protocol):
    """What acts, and learns from whole episodes."""

    @property
    def policy(self) -> nn.Module: ...

    @property
    def value(self) -> nn.Module: ...

    def act(self, observation: np.ndarray) -> int: ...

    def act_greedily(self, observation: np.ndarray) -> int: ...

    def learn(self, episode: Episode) -> Losses: ...


class Observer(Protocol):
    """Is told of every finished episode: a logger, a progress bar, a checkpoint writer."""

    def episode_done(self, record: EpisodeRecord) -> None: ...


def run_episode(env: CartPoleEnv, agent: Agent, should_stop: Callable[[], bool]) -> Episode | None:
    """Runs one episode with the agent's own, random choice of actions.

    Returns:
        The episode, or None if it was broken off because `should_stop()` became true.
    """
    episode = Episode()
    observation, _ = env.reset()
    finished = False
    while not finished:
        if should_stop():
            return None
        action = agent.act(observation)
        following, reward, terminated, truncated, _ = env.step(action)
        episode.add(observation, action, reward)
        observation = following
        finished = terminated or truncated
    episode.final_observation, episode.terminated = observation, terminated
    return episode


def train(
    env: CartPoleEnv,
    agent: Agent,
    episodes: int,
    history: History,
    observers: list[Observer],
    should_stop: Callable[[], bool] = lambda: False,
    stop_at: float | None = None,
) -> None:
    """Trains for that many episodes, or until `should_stop()`; an episode broken off is dropped.

    Args:
        stop_at: the mean length [steps] of the last 20 episodes with which it is done.

    Raises:
        SimulatorError: if the simulator fails; `history` and `agent` hold what was learned.
    """
    for index in range(episodes):
        episode = run_episode(env, agent, should_stop)
        if episode is None:
            return
        losses = agent.learn(episode)
        record = history.add(index, episode, losses)
        for observer in observers:
            observer.episode_done(record)
        if stop_at and history.is_solved(stop_at):
            return
