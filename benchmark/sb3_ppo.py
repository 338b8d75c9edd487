#!/usr/bin/env python3
"""Stable-Baselines3's PPO learns the robot: README's example, over ROS or in this process.

    ./ws extras
    ./ws python3 benchmark/sb3_ppo.py [--out FOLDER] [--steps 60000] [--seeds 3] [--inside 0]

`--inside 1` leaves ROS out; the bits are the same. Prints a table and writes sb3_ppo.json.
"""

import time

import gymnasium
import reporting
import torch
from stable_baselines3 import PPO

import cartpole  # noqa: F401 - registers the environments

WINDOW = 20  # [episodes]


def learn(seed: int, steps: int, backend: str) -> dict[str, float]:
    """Trains once; mean length of the last episodes, and how long it took."""
    env = gymnasium.make("cartpole/Classic-v0", backend=backend)
    try:
        begin = time.perf_counter()
        model = PPO(
            "MlpPolicy", env, learning_rate=2e-3, n_steps=1024, batch_size=256, gamma=0.995, seed=seed
        )
        model.learn(steps)
        lengths = [episode["l"] for episode in model.ep_info_buffer or []][-WINDOW:]
        return {"seed": seed, "mean length": sum(lengths) / len(lengths),
                "seconds": time.perf_counter() - begin}  # fmt: skip
    finally:
        env.close()


def main() -> None:
    options = reporting.options(__doc__ or "", steps=60_000, seeds=3, inside=0)
    torch.set_num_threads(1)
    backend = "bullet" if options.inside else "ros"
    rows = [learn(seed, options.steps, backend) for seed in range(options.seeds)]
    print(f"{'seed':>4} {'mean length of the last 20, of 500':>36} {'seconds':>8}")
    for row in rows:
        print(f"{row['seed']:4} {row['mean length']:36.1f} {row['seconds']:8.1f}")
    reporting.write(options.out, "sb3_ppo", {"backend": backend, "rows": rows})


if __name__ == "__main__":
    main()
