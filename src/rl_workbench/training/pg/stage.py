"""Where a training takes place: an environment to learn in, and one to be judged in."""

from typing import Any, NamedTuple

import gymnasium

from cartpole.environment import CartPoleEnv
from cartpole.tasks import BalanceTask, CartPoleState
from rl_workbench.training.pg.settings import ROBOT
from rl_workbench.training.run.environments import FiniteNumbers, make_environment, shares_robot
from rl_workbench.training.run.evaluation import NOISE
from robot_envs.backends.backend import RobotBackend

OTHER_SEED = 1_000_000  # added to the training's: other episodes than those learned from


class Stage(NamedTuple):
    """Two environments that don't disturb each other, and where the judge's seeds begin."""

    env: gymnasium.Env[Any, Any]
    judge: gymnasium.Env[Any, Any]
    seed_offset: int

    def close(self) -> None:
        """Closes both."""
        self.env.close()
        self.judge.close()


def robot_stage(backend: RobotBackend[CartPoleState], start_noise: float) -> Stage:
    """The robot's task. One robot does for both: every episode begins with a reset, to the bit.

    Args:
        start_noise: of the episodes that are learned from [m, rad].
    """
    env = CartPoleEnv(backend, BalanceTask(noise=start_noise))
    judge = CartPoleEnv(backend, BalanceTask(noise=NOISE))
    # In the training the losses tell of what isn't finite, without a look at each step.
    return Stage(env, FiniteNumbers(judge, ROBOT), 0)


def gymnasium_stage(env_id: str, env_kwargs: dict[str, Any]) -> Stage:
    """Any other environment, in this process.

    Raises:
        WorkbenchError: if it can't be made.
    """
    env = make_environment(env_id, env_kwargs)
    judge = env if shares_robot(env) else make_environment(env_id, env_kwargs)
    return Stage(env, judge, OTHER_SEED)
