#!/usr/bin/env python3
"""Sensors in a task: the rover's laser as numbers, its depth camera as a picture.

./ws python3 examples/sensor_readings.py depth.png
"""

import sys
from typing import Any

import numpy as np
from PIL import Image

from robot_envs import RobotEnv, StateQuery
from robot_envs.robots.rover import ROBOT, Navigate


class Look(Navigate):
    """Navigate that sees the depth camera, too."""

    def __init__(self) -> None:
        super().__init__()
        self.query = StateQuery(models=("rover",), sensors=("laser", "camera"))


env: Any = RobotEnv(ROBOT, Look())
env.reset(seed=0)
for _ in range(5):
    env.step(np.array((0.0, 0.5), np.float32))  # turns
laser, camera = (env.state.sensors[name] for name in ("laser", "camera"))
print(f"{laser.ranges.size} ranges at {laser.time:.2f} s, the nearest {laser.ranges.min():.2f} m")
brightness = 255.0 * np.nan_to_num(0.3 / camera.depth)  # what is near is bright
Image.fromarray(brightness.clip(0.0, 255.0).astype(np.uint8)).save(sys.argv[1])
env.close()
