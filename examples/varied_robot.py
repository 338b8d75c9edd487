#!/usr/bin/env python3
"""Another robot in each episode: masses, friction and gravity vary, and the sensor is noisy and late.

./ws python3 examples/varied_robot.py
"""

import gymnasium

import cartpole  # noqa: F401  registers cartpole/Classic-v0

env = gymnasium.make(
    "cartpole/Classic-v0",
    sensor_noise=(0.001, 0.02, 0.002, 0.05),  # of the four numbers observed, in their units
    sensor_delay=1,  # [control steps]
    randomisation={"mass": 0.2, "friction": {"cart_pole": (0.0, 0.01)}, "gravity": 0.02},
)
for seed in range(3):
    _, info = env.reset(seed=seed)
    steps, over = 0, False
    while not over:
        _, _, terminated, truncated, _ = env.step(steps % 2)
        steps, over = steps + 1, terminated or truncated
    print(f"seed {seed}: {steps} steps with masses scaled by {info['variation']['mass']}")
env.close()
