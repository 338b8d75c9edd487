"""Stable-Baselines3's DQN on CartPole-v1, measured as ours is; needs ./ws extras."""

import time
from typing import Any

import gymnasium
import torch
from dqn_runs import EPISODES, SOLVED, TEST_SEED
from stable_baselines3 import DQN
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.evaluation import evaluate_policy

# rl-baselines3-zoo, hyperparams/dqn.yml, CartPole-v1
ZOO: dict[str, Any] = {
    "learning_rate": 2.3e-3,
    "batch_size": 64,
    "buffer_size": 100_000,
    "learning_starts": 1_000,
    "gamma": 0.99,
    "target_update_interval": 10,
    "train_freq": 256,
    "gradient_steps": 128,
    "exploration_fraction": 0.16,
    "exploration_final_eps": 0.04,
    "policy_kwargs": {"net_arch": [256, 256]},
}
EVERY, SHORT = 1_000, 10  # as dqn_train.py's eval_frequency and eval_episodes


class Best(BaseCallback):
    """Keeps the best policy, chosen as ours is: ten episodes, confirmed by a hundred."""

    def __init__(self, seed: int) -> None:
        super().__init__()
        self._env = gymnasium.make("CartPole-v1")
        self._seed = seed
        self._began = time.monotonic()
        self.best = -1.0
        self.weights: dict[str, torch.Tensor] = {}
        self.solved: tuple[int | None, float | None] = (None, None)

    def _on_step(self) -> bool:
        if self.num_timesteps % EVERY == 0 and self._mean(SHORT) > self.best:
            confirmed = self._mean(EPISODES)
            if confirmed > self.best:
                self._keep(confirmed)
        return True

    def _mean(self, episodes: int) -> float:
        return mean(self.model, self._env, episodes, 1_000_000 + self._seed)

    def _keep(self, confirmed: float) -> None:
        state = self.model.policy.state_dict()
        self.best = confirmed
        self.weights = {name: tensor.clone() for name, tensor in state.items()}
        if confirmed >= SOLVED and self.solved[0] is None:
            self.solved = (self.num_timesteps, round(time.monotonic() - self._began, 1))


def mean(model: Any, env: gymnasium.Env, episodes: int, seed: int) -> float:
    """The mean return of greedy episodes."""
    env.reset(seed=seed)
    return float(evaluate_policy(model, env, episodes, warn=False)[0])


def train(seed: int, steps: int) -> dict[str, Any]:
    """Trains one seed; returns its row of the table."""
    torch.set_num_threads(1)
    model = DQN("MlpPolicy", gymnasium.make("CartPole-v1"), seed=seed, device="cpu", **ZOO)
    callback, began, used = Best(seed), time.monotonic(), time.process_time()
    model.learn(steps, callback=callback)
    seconds = round(time.monotonic() - began, 1)
    cpu_seconds = round(time.process_time() - used, 1)
    env = gymnasium.make("CartPole-v1")
    final = mean(model, env, EPISODES, TEST_SEED + seed)
    model.policy.load_state_dict(callback.weights)
    return {
        "algorithm": "Stable-Baselines3 DQN",
        "seed": seed,
        "solved_step": callback.solved[0],
        "solved_seconds": callback.solved[1],
        "steps": steps,
        "seconds": seconds,
        "command_seconds": None,
        "cpu_seconds": cpu_seconds,
        "best_greedy": round(mean(model, env, EPISODES, TEST_SEED + seed), 2),
        "final_greedy": round(final, 2),
    }
