"""Greedy evaluation: how long the learned policy balances when it stops exploring."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from cartpole.agents.policy_gradient import PolicyGradientAgent
from cartpole.envs.cartpole_env import CartPoleEnv
from cartpole.envs.plant import Plant
from cartpole.task import BalanceTask

EPISODES = 20
# The simulator repeats itself: from the upright state a greedy policy would run the same
# episode 20 times. So each starts from its own seeded position [m] and angle [rad] within this.
NOISE = 0.02


@dataclass(frozen=True)
class Evaluation:
    """Lengths [steps] and undiscounted returns, one for each episode."""

    lengths: list[int]
    returns: list[float]

    @property
    def mean_length(self) -> float:
        return float(np.mean(self.lengths))

    @property
    def mean_return(self) -> float:
        return float(np.mean(self.returns))


def evaluate(
    plant: Plant,
    agent: PolicyGradientAgent,
    seed: int,
    episodes: int = EPISODES,
    should_stop: Callable[[], bool] = lambda: False,
) -> Evaluation | None:
    """Runs greedy episodes from seeded initial states; None if told to stop."""
    env = CartPoleEnv(plant, BalanceTask(noise=NOISE))
    lengths, returns = [], []
    for index in range(episodes):
        observation, _ = env.reset(seed=seed if index == 0 else None)
        length, total, finished = 0, 0.0, False
        while not finished:
            if should_stop():
                return None
            observation, reward, terminated, truncated, _ = env.step(
                agent.act_greedily(observation)
            )
            length, total = length + 1, total + reward
            finished = terminated or truncated
        lengths.append(length)
        returns.append(total)
    return Evaluation(lengths, returns)
