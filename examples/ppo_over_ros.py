#!/usr/bin/env python3
"""Stable-Baselines3's PPO on the cart-pole over ROS, without the workbench.

    ./ws extras python3 examples/ppo_over_ros.py

The simulator, the robot and its controllers start by themselves and end with the script.
"""

import gymnasium
from stable_baselines3 import PPO
from stable_baselines3.common.evaluation import evaluate_policy

import cartpole  # noqa: F401  registers cartpole/Classic-v0

env = gymnasium.make("cartpole/Classic-v0", backend="ros")
model = PPO("MlpPolicy", env, learning_rate=2e-3, n_steps=1024, batch_size=256, gamma=0.995, verbose=1)
model.learn(60_000)
model.save("ppo_cartpole.zip")  # PPO.load("ppo_cartpole.zip").predict(observation) acts
mean, _ = evaluate_policy(model, env, n_eval_episodes=5)
print("steps of 500:", mean)
env.close()
