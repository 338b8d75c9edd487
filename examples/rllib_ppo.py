#!/usr/bin/env python3
"""RLlib's PPO on the cart-pole, with episodes played by the workers of a Ray cluster.

RLlib pins another version of Gymnasium than this project, so it needs a virtual environment of its own, on
each node:

    python3 -m venv rllib
    rllib/bin/pip install "ray[rllib]==2.60.0" torch==2.13.0 pybullet==3.2.7 trimesh==5.2.0 xacro==2.1.1
    rllib/bin/pip install --no-deps .
    rllib/bin/python examples/rllib_ppo.py --workers 2               # on this machine
    rllib/bin/python examples/rllib_ppo.py --workers 8 --ray auto    # on the cluster of this machine
"""

import argparse
from typing import Any

import gymnasium
import ray
from ray.rllib.algorithms.ppo import PPOConfig
from ray.tune.registry import register_env


def make_env(options: dict[str, Any]) -> gymnasium.Env[Any, Any]:
    """Makes the environment; each worker calls it."""
    return gymnasium.make("cartpole:cartpole/Classic-v0", **options)


def main() -> None:
    parser = argparse.ArgumentParser(description="RLlib's PPO on the cart-pole")
    parser.add_argument("--ray", metavar="ADDRESS", help="of a cluster; default: start one here")
    parser.add_argument("--workers", type=int, default=2, help="that play episodes (default 2)")
    parser.add_argument("--iterations", type=int, default=30)
    options = parser.parse_args()
    ray.init(address=options.ray)
    register_env("cartpole-classic", make_env)
    config = (
        PPOConfig()
        .environment("cartpole-classic", env_config={"backend": "bullet"})
        .env_runners(num_env_runners=options.workers)
        .training(lr=2e-3, gamma=0.995, train_batch_size_per_learner=2000, minibatch_size=250)
        .debugging(seed=0)
    )
    algorithm = config.build_algo()
    for iteration in range(options.iterations):
        results = algorithm.train()["env_runners"]
        print(f"{iteration + 1}: mean return {results['episode_return_mean']:.1f} of 500")
    print("saved to", algorithm.save_to_path())
    algorithm.stop()


if __name__ == "__main__":
    main()
