#!/usr/bin/env python3
"""An episode as a GIF, drawn without a display.

./ws python3 examples/record_gif.py hopper.gif
"""

import sys
from typing import Any

import gymnasium
from PIL import Image

import robot_envs.robots  # noqa: F401  registers robot_envs/Hopper-v0

env: Any = gymnasium.make("robot_envs/Hopper-v0", render_mode="rgb_array")
env.action_space.seed(0)
env.reset(seed=0)
frames: list[Image.Image] = []
over = False
while not over and len(frames) < 50:
    _, _, terminated, truncated, _ = env.step(env.action_space.sample())
    frames.append(Image.fromarray(env.render()))
    over = terminated or truncated
frames[0].save(sys.argv[1], save_all=True, append_images=frames[1:], duration=40, loop=0)  # [ms]
print(f"{len(frames)} pictures of {frames[0].width} x {frames[0].height} in {sys.argv[1]}")
env.close()
