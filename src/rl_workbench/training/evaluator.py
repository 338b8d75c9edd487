"""Evaluation of policies by greedy episodes, without side effects on the training."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import count
from typing import Any, NamedTuple

import numpy as np

from rl_workbench.errors import WorkbenchError
from rl_workbench.states import random_states, restore_random_states
from rl_workbench.training.algorithm import Algorithm, Say
from rl_workbench.training.checked import Env
from rl_workbench.training.environments import as_float32, environment_for, shares_robot, succeeded
from rl_workbench.training.options import TrainingOptions

Act = Callable[[Any], Any]  # an observation to an action
EVALUATION_SEED = 1_000_000  # added to the training's: other episodes than those learned from


@dataclass(frozen=True)
class Evaluation:
    """Lengths [steps], undiscounted returns and successes of episodes."""

    lengths: list[int]
    returns: list[float]
    successes: list[bool] = field(default_factory=list)  # of the episodes that say so

    @property
    def mean_length(self) -> float:
        return float(np.mean(self.lengths))

    @property
    def mean_return(self) -> float:
        return float(np.mean(self.returns))

    @property
    def success_rate(self) -> float | None:
        """Between 0 and 1; None if no episode reports success."""
        return float(np.mean(self.successes)) if self.successes else None


class Step(NamedTuple):
    """The result of a step; the first one is the reset, which has no action."""

    observation: Any
    action: Any
    reward: float
    finished: bool
    success: bool | None  # None before the end, or if the environment doesn't say


def episode_steps(env: Env, act: Act, seed: int | None, max_steps: int = 0) -> Iterator[Step]:
    """Plays one episode; yields the reset and each step, at most `max_steps` of them unless that is 0."""
    observation, _ = env.reset(seed=seed)
    yield Step(observation, None, 0.0, False, None)
    for length in count(1):
        action = act(as_float32(observation))
        observation, reward, terminated, truncated, info = env.step(action)
        finished = terminated or truncated or length == max_steps
        success = succeeded(info) if finished else None
        yield Step(observation, action, float(reward), finished, success)
        if finished:
            return


def run_greedily(
    env: Env, act: Act, seed: int, episodes: int, should_stop: Callable[[], bool] = lambda: False
) -> Evaluation | None:
    """Plays episodes in an environment, seeded once; returns None if `should_stop()` became true."""
    result = Evaluation([], [])
    for index in range(episodes):
        length, total = -1, 0.0  # the first step is the reset
        for step in episode_steps(env, act, None if index else seed):
            if should_stop():
                return None
            length, total = length + 1, total + step.reward
        result.lengths.append(length)
        result.returns.append(total)
        if step.success is not None:
            result.successes.append(step.success)
    return result


class Evaluator:
    """Evaluates an algorithm's policy, in a separate environment if possible.

    If all environments share one robot, an evaluation moves the training's, which is brought back afterwards.
    """

    def __init__(
        self,
        options: TrainingOptions,
        algorithm: Algorithm,
        env: Env,
        should_stop: Callable[[], bool],
        say: Say,
    ) -> None:
        self._run, self._algorithm, self._should_stop = options.run, algorithm, should_stop
        self._is_guest = shares_robot(env)
        self._env = self._training_env = env
        is_same = self._run.evaluation_environment == self._run.training_environment
        if not (self._is_guest and is_same):
            try:
                self._env = environment_for(options, self._run.evaluation_environment)
            except WorkbenchError as error:
                if not is_same:
                    raise
                self._is_guest = True
                say(f"evaluating in the training's environment, because a second one can't be made: {error}")

    def evaluate(self, best: float, say: Say, is_last: bool = False) -> tuple[Evaluation, float] | None:
        """Plays greedy episodes; also returns the mean that ranks policies; None if interrupted.

        A policy that is perfect in ten episodes may well fail in the next ninety. So one whose mean return is
        above `best` is confirmed over `confirm_episodes`. `say` is called at the training's end (`is_last`),
        or if the current episode can't be restored, which isn't tried there.
        """
        self._algorithm.check_weights()
        if is_last:
            say(f"evaluating the policy over {self._run.eval_episodes} greedy episodes")
        with self._undisturbed(say, is_last):
            evaluation = self._episodes(self._run.eval_episodes, 0)
            if evaluation is None:
                return None
            if evaluation.mean_return <= best or not self._run.confirm_episodes:
                return evaluation, evaluation.mean_return
            confirmed = self._episodes(self._run.confirm_episodes, 1)
            return None if confirmed is None else (evaluation, confirmed.mean_return)

    @contextmanager
    def _undisturbed(self, say: Say, is_last: bool) -> Iterator[None]:
        """Restores the environment and the process's random generators after the block."""
        must_return = self._is_guest and not is_last
        place = self._algorithm.leave_environment() if must_return else None
        states = random_states()
        try:
            yield
            if must_return:
                self._algorithm.restore_environment(place, say)
        finally:
            restore_random_states(states)

    def _episodes(self, episodes: int, stream: int) -> Evaluation | None:
        seed = self._run.seed + EVALUATION_SEED * (1 + stream)
        act = self._algorithm.act_greedily
        return run_greedily(self._env, act, seed, episodes, self._should_stop)

    def close(self) -> None:
        """Closes the environment, unless it is the training's."""
        if self._env is not self._training_env:
            self._env.close()
