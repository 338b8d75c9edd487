#!/usr/bin/env python3
"""Steps a second of DQN on CartPole-v1: ours, Stable-Baselines3's, and the environment alone.

    ./ws extras python3 benchmark/learning_speed.py [--steps 20000] [--rounds 3] [--out DIR]

One core, the same options; the median of the rounds. Ours is all of dqn_train.py but evaluations: CSV,
TensorBoard and checkpoints included. Stable-Baselines3's learns with neither log nor callback.
"""

import statistics
import tempfile
import time
from pathlib import Path
from typing import Any

import gymnasium
import reporting
import torch
from stable_baselines3 import DQN

from rl_workbench.starting import Interrupt
from rl_workbench.training.algorithms import algorithm
from rl_workbench.training.train import choose
from rl_workbench.training.training import Training

ENV_ID = "CartPole-v1"
# What both know, by our names; the first is the tutorial's, the second the tuned one's.
OPTIONS: dict[str, dict[str, Any]] = {
    "a gradient step each step, 128 x 128": {
        "learning_rate": 1e-3, "buffer_size": 10_000, "learning_starts": 100, "batch_size": 64,
        "train_frequency": 1, "gradient_steps": 1, "gamma": 0.99, "hidden_sizes": (128, 128),
        "target_network_frequency": 10, "exploration_fraction": 0.2, "end_e": 0.02,
    },
    "two each fourth step, 64 x 64": {
        "learning_rate": 1e-3, "buffer_size": 50_000, "learning_starts": 500, "batch_size": 64,
        "train_frequency": 4, "gradient_steps": 2, "gamma": 0.99, "hidden_sizes": (64, 64),
        "target_network_frequency": 100, "exploration_fraction": 0.05, "end_e": 0.02,
    },
}  # fmt: skip
# Stable-Baselines3's names; its target network counts steps of the environment, ours gradient steps.
NAMES = {"train_frequency": "train_freq", "end_e": "exploration_final_eps"}


def bare(steps: int) -> float:
    """The environment with random actions."""
    env = gymnasium.make(ENV_ID)
    env.reset(seed=0)
    began = time.perf_counter()
    for _ in range(steps):
        _, _, terminated, truncated, _ = env.step(env.action_space.sample())
        if terminated or truncated:
            env.reset()
    return steps / (time.perf_counter() - began)


def ours(options: dict[str, Any], steps: int) -> float:
    """dqn_train.py with one greedy episode at its end."""
    same = {"preset": "tutorial", "double": False, "loss": "huber", "epsilon_schedule": "linear",
            "episodes": 0, "eval_frequency": 0, "eval_episodes": 1,
            "confirm_episodes": 0}  # fmt: skip
    texts = {name: _text(value) for name, value in {**same, **options}.items()}
    chosen = choose(algorithm("dqn"), [], {**texts, "total_timesteps": str(steps)})
    with tempfile.TemporaryDirectory() as folder:
        training = Training(chosen, Path(folder), Interrupt())
        began = time.perf_counter()
        training.run()
        return steps / (time.perf_counter() - began)


def _text(value: Any) -> str:
    return ",".join(map(str, value)) if isinstance(value, tuple) else str(value)


def theirs(options: dict[str, Any], steps: int) -> float:
    """Stable-Baselines3's DQN."""
    rest = dict(options)
    net_arch = list(rest.pop("hidden_sizes"))
    interval = rest.pop("target_network_frequency")
    interval = interval * rest["train_frequency"] // rest["gradient_steps"]
    own = {NAMES.get(name, name): value for name, value in rest.items()}
    model = DQN("MlpPolicy", gymnasium.make(ENV_ID), seed=0, device="cpu", **own,
                target_update_interval=interval, policy_kwargs={"net_arch": net_arch})  # fmt: skip
    began = time.perf_counter()
    model.learn(steps)
    return steps / (time.perf_counter() - began)


def main() -> None:
    chosen = reporting.options(__doc__ or "", steps=20_000, rounds=3)
    torch.set_num_threads(1)
    results: dict[str, list[float]] = {}
    for _ in range(chosen.rounds):
        results.setdefault("the environment alone", []).append(bare(chosen.steps))
        for name, options in OPTIONS.items():
            results.setdefault(f"ours, {name}", []).append(ours(options, chosen.steps))
            results.setdefault(f"Stable-Baselines3, {name}", []).append(theirs(options, chosen.steps))
    medians = {name: round(statistics.median(values)) for name, values in results.items()}
    for name, value in medians.items():
        print(f"{value:8d} steps/s  {name}")
    reporting.write(chosen.out, "learning_speed", medians)


if __name__ == "__main__":
    main()
