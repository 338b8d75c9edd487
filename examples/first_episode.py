#!/usr/bin/env python3
"""A first episode: make an environment, act at random, look at what comes back.

./ws python3 examples/first_episode.py
"""

import gymnasium

import cartpole  # noqa: F401  registers cartpole/Classic-v0

env = gymnasium.make("cartpole/Classic-v0")
env.action_space.seed(0)
observation, info = env.reset(seed=0)
total, terminated, truncated = 0.0, False, False
while not (terminated or truncated):
    action = env.action_space.sample()
    observation, reward, terminated, truncated, info = env.step(action)
    total += float(reward)
print(f"cart and pole at {observation[0]:+.3f} m and {observation[2]:+.3f} rad; return {total:g}")
env.close()
