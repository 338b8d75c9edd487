"""What a policy of Stable-Baselines3 is worth: greedy episodes, by the same rule as for DQN."""

from collections.abc import Callable
from typing import Any

from rl_workbench.training.dqn.judge import EVALUATION_SEED, Verdict
from rl_workbench.training.run.environments import make_environment
from rl_workbench.training.run.evaluation import run_greedily
from rl_workbench.training.sb3.model import greedy
from rl_workbench.training.sb3.settings import SB3Run
from rl_workbench.training.sb3.state import check_weights


class SB3Judge:
    """Evaluates a model in an environment of its own.

    Args:
        run: how many episodes, and from which seed.
        model: acts greedily.
        should_stop: is asked before each step.

    Raises:
        WorkbenchError: if the environment can't be made.
    """

    def __init__(self, run: SB3Run, model: Any, should_stop: Callable[[], bool]) -> None:
        self._run, self._model, self._should_stop = run, model, should_stop
        self._env = make_environment(run.env_id, run.env_kwargs)

    def judge(self, best: float) -> Verdict | None:
        """Evaluates the policy; None if interrupted.

        Args:
            best: mean return of the best policy so far; a better one is confirmed.

        Raises:
            WorkbenchError: if the weights are no numbers, or the environment fails.
        """
        check_weights(self._model)
        mean = self._mean_return(self._run.eval_episodes, 0)
        if mean is None or mean <= best or not self._run.confirm_episodes:
            return None if mean is None else Verdict(mean, mean)
        confirmed = self._mean_return(self._run.confirm_episodes, 1)
        return None if confirmed is None else Verdict(mean, confirmed)

    def _mean_return(self, episodes: int, stream: int) -> float | None:
        seed = self._run.seed + EVALUATION_SEED * (1 + stream)
        act, stop = greedy(self._model), self._should_stop
        result = run_greedily(self._env, act, seed, episodes, stop)
        return None if result is None else result.mean_return

    def close(self) -> None:
        """Closes its environment."""
        self._env.close()
