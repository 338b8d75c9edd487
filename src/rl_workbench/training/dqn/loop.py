"""The DQN training loop: one step of the environment at a time, and what follows from it."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from rl_workbench.agents.dqn.agent import DQNAgent, Learned
from rl_workbench.training.dqn.episode_tape import EpisodeTape
from rl_workbench.training.run.history import History


@dataclass(frozen=True)
class Episode:
    """One finished episode."""

    index: int
    steps: int  # of the whole training, this episode included
    length: int  # [steps]
    total_reward: float
    epsilon: float
    steps_per_second: float  # since the training began or was resumed


class Observer(Protocol):
    """Is told what happens: a logger, a progress bar."""

    def episode_done(self, episode: Episode) -> None: ...
    def step_done(self, steps: int) -> None: ...
    def learned(self, steps: int, learned: Learned) -> None: ...


class Loop:
    """Steps the environment, lets the agent learn, and tells the observers.

    Args:
        tape: the environment.
        agent: it counts the steps.
        history: is filled.
        observers: are told.
        log_frequency: steps between two reports of a loss.
    """

    def __init__(
        self,
        tape: EpisodeTape,
        agent: DQNAgent,
        history: History,
        observers: list[Observer],
        log_frequency: int,
    ) -> None:
        self._tape = tape
        self._agent = agent
        self._history = history
        self._observers = observers
        self._log_frequency = log_frequency
        self._observation: np.ndarray | None = None  # None: an episode has to be begun
        self._reward = 0.0  # of the episode so far
        self._last: Learned | None = None
        self._began, self._first_step = time.monotonic(), agent.steps
        self._seconds_before = history.seconds

    def step(self) -> None:
        """One step.

        Raises:
            WorkbenchError: if a loss isn't finite, or the environment fails.
        """
        agent = self._agent
        observation = self._tape.reset() if self._observation is None else self._observation
        action = agent.act(observation)
        following, reward, terminated, truncated = self._tape.step(action)
        self._reward += reward
        agent.observe((observation, action, reward), following, terminated, truncated)
        if agent.is_due:
            self._last = agent.learn()
        self._observation = following
        if terminated or truncated:
            self._end_episode()
        self._tell()

    def _tell(self) -> None:
        steps = self._agent.steps
        for observer in self._observers:
            observer.step_done(steps)
            if self._last is not None and steps % self._log_frequency == 0:
                observer.learned(steps, self._last)

    def _end_episode(self) -> None:
        history, agent = self._history, self._agent
        agent.episode_done()
        history.returns.append(self._reward)
        history.lengths.append(self._tape.length)
        elapsed = self.update_clock()
        episode = Episode(
            len(history.returns) - 1,
            agent.steps,
            self._tape.length,
            self._reward,
            agent.epsilon,
            (agent.steps - self._first_step) / elapsed,
        )
        self._observation, self._reward = None, 0.0
        for observer in self._observers:
            observer.episode_done(episode)

    def update_clock(self) -> float:
        """Brings the history's seconds up to now; returns those since the loop was made."""
        elapsed = max(time.monotonic() - self._began, 1e-9)
        self._history.seconds = self._seconds_before + elapsed
        return elapsed

    def state_dict(self) -> dict[str, Any]:
        """The episode under way, if there is one, and the last loss."""
        under_way = self._observation is not None
        return {
            "tape": self._tape.state_dict() if under_way else None,
            "generator": self._tape.generator,
            "reward": self._reward,
            "last": None if self._last is None else list(self._last),
        }

    def load_state_dict(self, state: dict[str, Any], say: Callable[[str], None]) -> None:
        """Brings the environment to where it was; says so if it can't be brought there."""
        self._last = None if state["last"] is None else Learned(*state["last"])
        self._tape.generator = state["generator"]
        if state["tape"] is None:
            return
        self._observation = self._tape.load_state_dict(state["tape"])
        self._reward = state["reward"]
        if self._observation is None:
            say("the environment doesn't repeat itself: the episode under way is given up")
            self._reward = 0.0
            self._agent.episode_done()
