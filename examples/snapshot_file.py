#!/usr/bin/env python3
"""A moment in a file: another environment, in this process or on another day, goes on from it to the bit.

./ws python3 examples/snapshot_file.py moment.snapshot
"""

import sys
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

import robot_envs.robots  # noqa: F401  registers robot_envs/Furuta-v0
from robot_envs import EnvSnapshot

actions = np.random.default_rng(0).uniform(-1.0, 1.0, (60, 1)).astype(np.float32)
env: Any = gymnasium.make("robot_envs/Furuta-v0").unwrapped
env.reset(seed=0)
for action in actions[:30]:
    env.step(action)
env.save_state().save(sys.argv[1])
seen = [env.step(action)[0] for action in actions[30:]]

other: Any = gymnasium.make("robot_envs/Furuta-v0").unwrapped
other.restore_state(EnvSnapshot.load(sys.argv[1]))
again = [other.step(action)[0] for action in actions[30:]]
size = Path(sys.argv[1]).stat().st_size
print(f"{size} bytes; 30 steps behind it are equal: {np.array_equal(seen, again)}")
