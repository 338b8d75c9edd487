"""What a DQN policy is worth: greedy episodes that leave nothing behind in the training."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

import gymnasium

from rl_workbench.agents.dqn.agent import DQNAgent
from rl_workbench.training.dqn.loop import Loop
from rl_workbench.training.dqn.settings import RunSettings
from rl_workbench.training.run.environments import make_environment, shares_robot
from rl_workbench.training.run.evaluation import run_greedily
from rl_workbench.training.run.random_states import random_states, restore_random_states

EVALUATION_SEED = 1_000_000  # added to the training's: other episodes than those learned from


class Verdict(NamedTuple):
    """Two means of returns: over an evaluation's episodes, and the one to compare policies by."""

    mean: float
    confirmed: float


class Judge:
    """Evaluates an agent, in an environment of its own wherever there can be a second one.

    Over ROS there is one robot in one simulator. An evaluation there is held with the training's
    own environment, and the episode under way is then brought back to where it was.

    Args:
        run: how many episodes, and from which seed.
        agent: acts greedily.
        env: the training's.
        should_stop: is asked before each step.

    Raises:
        WorkbenchError: if the second environment can't be made.
    """

    def __init__(
        self,
        run: RunSettings,
        agent: DQNAgent,
        env: gymnasium.Env[Any, Any],
        should_stop: Callable[[], bool],
    ) -> None:
        self._run = run
        self._agent = agent
        self._should_stop = should_stop
        self._is_guest = not run.eval_frequency or shares_robot(env)
        self._env = env if self._is_guest else make_environment(run.env_id, run.env_kwargs)

    def judge(self, loop: Loop, best: float, say: Callable[[str], None]) -> Verdict | None:
        """Evaluates the policy; None if interrupted.

        A policy that is perfect in ten episodes may well fall in the next ninety: one that seems
        to be the best so far is confirmed over many more.

        Args:
            loop: the training, between two steps.
            best: mean return of the best policy so far.
            say: is told if the episode under way can't be brought back.

        Raises:
            WorkbenchError: if the environment fails.
        """
        with self._undone(loop, say):
            mean = self._mean_return(self._run.eval_episodes, 0)
            if mean is None or mean <= best:
                return None if mean is None else Verdict(mean, mean)
            confirmed = self._mean_return(self._run.confirm_episodes, 1)
            return None if confirmed is None else Verdict(mean, confirmed)

    @contextmanager
    def _undone(self, loop: Loop, say: Callable[[str], None]) -> Iterator[None]:
        """What is done inside is forgotten afterwards, also by generators that all share."""
        before, states = loop.state_dict(), random_states()
        yield
        if self._is_guest:
            loop.load_state_dict(before, say)
        restore_random_states(states)

    def _mean_return(self, episodes: int, stream: int) -> float | None:
        seed = self._run.seed + EVALUATION_SEED * (1 + stream)
        act, stop = self._agent.act_greedily, self._should_stop
        result = run_greedily(self._env, act, seed, episodes, stop)
        return None if result is None else result.mean_return

    def close(self) -> None:
        """Closes the environment, if it is this one's own."""
        if not self._is_guest:
            self._env.close()
