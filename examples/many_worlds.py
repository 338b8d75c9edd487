#!/usr/bin/env python3
"""Eight worlds at once: a vector of environments that takes and returns arrays.

./ws python3 examples/many_worlds.py
"""

import gymnasium
import numpy as np

import cartpole  # noqa: F401  registers cartpole/Balance-v0

envs = gymnasium.make_vec("cartpole/Balance-v0", num_envs=8, noise=0.02)
observations, _ = envs.reset(seed=0)  # each world with a seed of its own, 0 to 7
lengths = np.zeros(8, int)
alive = np.ones(8, bool)
while alive.any():
    lean = observations[:, 2] + 0.1 * observations[:, 3]  # pole angle [rad] and velocity [rad/s]
    observations, _, terminated, truncated, _ = envs.step((lean < 0.0).astype(int))
    lengths += alive
    alive &= ~(terminated | truncated) & (lengths < 500)
print("steps of the eight episodes:", *lengths)
envs.close()
