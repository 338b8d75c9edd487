#!/usr/bin/env python3
"""What snapshots cost, and how many steps a second a planner gets that tries plans from one.

    ./ws extras python3 benchmark/snapshots.py [--out FOLDER] [--plans 10] [--horizon 20] [--rounds 5]

The robots that come along, in-process with both engines and over ROS. Each plan, of random actions, begins
with a restore. Medians over rounds, in-process of the processor's time, over ROS by the clock. Prints a table
and writes snapshots.json.
"""

import statistics
import time
from collections.abc import Callable
from typing import Any

import gymnasium
import reporting

import cartpole  # noqa: F401 - registers the environments
import robot_envs.robots  # noqa: F401
from robot_envs import RobotEnv

IDS = (
    "cartpole/Balance-v0", "robot_envs/TwoLinkReach-v0", "robot_envs/SixJointReach-v0",
    "robot_envs/PickCube-v0", "robot_envs/Furuta-v0", "robot_envs/DoublePendulum-v0",
    "robot_envs/Hopper-v0", "robot_envs/Navigate-v0", "robot_envs/NavigateImages-v0",
)  # fmt: skip
BACKENDS = ("bullet", "mujoco", "ros-own")
COLUMNS = ("save [ms]", "restore [ms]", "steps/s")


def measure(env: RobotEnv, clock: Callable[[], float], plans: int, horizon: int) -> list[float]:
    """Returns what a save and a restore take [ms], and steps a second."""
    actions = [env.action_space.sample() for _ in range(horizon)]
    now, steps = env.save_state(), 0
    saves, restores, stepped = [], [], 0.0  # [s]
    for _ in range(plans):
        begin = clock()
        env.restore_state(now)
        restored = clock()
        for action in actions:
            _, _, terminated, truncated, _ = env.step(action)
            steps += 1
            if terminated or truncated:
                break
        done = clock()
        env.save_state()
        saves.append(clock() - done)
        restores.append(restored - begin)
        stepped += done - restored
    env.restore_state(now)
    save, restore = (1000.0 * statistics.median(each) for each in (saves, restores))
    return [save, restore, steps / (stepped + sum(restores))]


def main() -> None:
    chosen = reporting.options(__doc__ or "", plans=10, horizon=20, rounds=5)
    results = {}
    print("{:34} {:>10} {:>13} {:>8}".format("", *COLUMNS))
    for identifier in IDS:
        for backend in BACKENDS:
            env: Any = gymnasium.make(identifier, backend=backend).unwrapped
            clock = time.perf_counter if backend == "ros-own" else time.process_time
            env.reset(seed=0)
            env.action_space.seed(0)
            rounds = [measure(env, clock, chosen.plans, chosen.horizon) for _ in range(chosen.rounds)]
            env.close()
            found = [statistics.median(each) for each in zip(*rounds, strict=True)]
            results[f"{identifier}, {backend}"] = dict(zip(COLUMNS, found, strict=True))
            save, restore, rate = found
            name = f"{identifier.partition('/')[2]}, {backend}"
            print(f"{name:34} {save:10.3f} {restore:13.3f} {rate:8,.0f}", flush=True)
    reporting.write(chosen.out, "snapshots", results)


if __name__ == "__main__":
    main()
