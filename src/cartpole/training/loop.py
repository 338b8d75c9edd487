"""The training loop: run an episode, learn from it, report, save."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

from cartpole.agents.policy_gradient import Episode, Losses, PolicyGradientAgent
from cartpole.envs.cartpole_env import CartPoleEnv


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

    @property
    def lengths(self) -> list[int]:
        return [record.length for record in self.episodes]

    @property
    def returns(self) -> list[float]:
        return [record.total_reward for record in self.episodes]


class Observer(Protocol):
    """Is told of every finished episode: a logger, a progress bar, a checkpoint writer."""

    def episode_done(self, record: EpisodeRecord) -> None: ...


def run_episode(
    env: CartPoleEnv, agent: PolicyGradientAgent, should_stop: Callable[[], bool]
) -> Episode | None:
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
    return episode


def train(
    env: CartPoleEnv,
    agent: PolicyGradientAgent,
    episodes: int,
    history: History,
    observers: list[Observer],
    should_stop: Callable[[], bool] = lambda: False,
) -> None:
    """Trains for that many episodes, or until `should_stop()`; an episode broken off is dropped.

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
