#!/usr/bin/env python3
"""Pictures without a display: how many of the cart-pole a second.

    ./ws python3 benchmark/pictures.py [--out FOLDER] [--frames 60] [--rounds 5]

One process, one core. Prints a table and writes pictures.json.
"""

import math
import statistics
import time

import reporting

from cartpole.environment import CAMERA
from cartpole.robot import CART_JOINT, POLE_JOINT, ROBOT
from robot_envs.pictures.drawn import RobotPicture

SIZES = ((320, 240), (640, 320), (640, 480))


def rate(width: int, height: int, frames: int) -> float:
    """Pictures a second of the process's own time, the pole going round."""
    picture = RobotPicture(ROBOT, width, height, camera=CAMERA)
    picture({CART_JOINT: 0.0, POLE_JOINT: 0.0})  # loads
    begin = time.process_time()
    for frame in range(frames):
        picture({CART_JOINT: 0.3 * math.sin(0.1 * frame), POLE_JOINT: 0.1 * frame})
    spent = time.process_time() - begin
    picture.close()
    return frames / spent


def main() -> None:
    args = reporting.options(__doc__ or "", frames=60, rounds=5)
    results = {}
    for width, height in SIZES:
        rates = sorted(rate(width, height, args.frames) for _ in range(args.rounds))
        results[f"{width}x{height}"] = {"rates": rates, "median": statistics.median(rates)}
        print(f"{width} x {height}: {statistics.median(rates):6.1f} pictures/s of {rates}")
    reporting.write(args.out, "pictures", results)


if __name__ == "__main__":
    main()
