#!/usr/bin/env python3
"""Environment steps a second in-process, alone and as vectors.

    ./ws python3 benchmark/environments.py [--out FOLDER] [--seconds 2.0] [--rounds 5] [--worlds 32]

A step is 8 physics steps of 1 ms of the cart-pole with its position controller, resets included. All rates
of a round are taken one after the other; the tables show medians over rounds. Prints tables and writes
environments.json.
"""

import statistics
import time
from collections.abc import Callable
from typing import Any

import gymnasium
import reporting

import cartpole  # noqa: F401 - registers the environments
from cartpole.robot import CONTROLLER

IDS = ("cartpole/Balance-v0", "cartpole/Classic-v0", "cartpole/SwingUp-v0")
VECTOR = IDS[0]
TARGET = 13_000.0  # steps a second of one environment
BATCH = 200  # steps between looks at the clock


def rate(batch: Callable[[], int], seconds: float) -> float:
    """Steps [1/s] that calls of `batch` do, each of which returns how many it did."""
    batch()  # warms up
    steps, begin = 0, time.perf_counter()
    while (passed := time.perf_counter() - begin) < seconds:
        steps += batch()
    return steps / passed


def single(identifier: str, **options: Any) -> Callable[[], int]:
    """Random actions in one environment."""
    env = gymnasium.make(identifier, **options).unwrapped
    env.action_space.seed(0)
    actions = [env.action_space.sample() for _ in range(BATCH)]
    env.reset(seed=0)

    def batch() -> int:
        for action in actions:
            _, _, terminated, truncated, _ = env.step(action)
            if terminated or truncated:
                env.reset()
        return BATCH

    return batch


def several(worlds: int, **options: Any) -> Callable[[], int]:
    """Random actions in many environments."""
    env = gymnasium.make_vec(VECTOR, worlds, **options)
    env.action_space.seed(0)
    actions = [env.action_space.sample() for _ in range(BATCH)]
    env.reset(seed=0)

    def batch() -> int:
        for action in actions:
            env.step(action)
        return BATCH * worlds

    return batch


def robot_alone() -> Callable[[], int]:
    """What of a step is the simulator's."""
    env: Any = gymnasium.make(VECTOR).unwrapped
    env.reset(seed=0)

    def batch() -> int:
        for index in range(BATCH):
            env.backend.act({CONTROLLER: 0.02 * (index % 2)})
        return BATCH

    return batch


def subjects(worlds: int) -> dict[str, Callable[[], int]]:
    """What is measured."""
    noisy = {"sensor_noise": 0.01, "sensor_delay": 2}
    return {
        "the robot alone": robot_alone(),
        **{identifier: single(identifier) for identifier in IDS},
        "with a noisy, late sensor": single(VECTOR, **noisy),
        "with random masses and friction": single(VECTOR, randomisation={"mass": 0.2, "cart_friction": 0.5}),
        "with random lengths, too": single(VECTOR, randomisation={"mass": 0.2, "length": 0.1}),
        f"{worlds} worlds": several(worlds),
        f"{worlds} worlds, Gymnasium's async": several(worlds, vectorization_mode="async"),
    }


def main() -> None:
    chosen = reporting.options(__doc__ or "", seconds=2.0, rounds=5, worlds=32)
    batches = subjects(chosen.worlds)
    taken: dict[str, list[float]] = {name: [] for name in batches}
    for _ in range(chosen.rounds):
        for name, batch in batches.items():
            taken[name].append(rate(batch, chosen.seconds))
    rates = {name: statistics.median(values) for name, values in taken.items()}
    print(f"{'steps a second, 8 ticks each':36} {'median':>9} {'target':>9}")
    for name, value in rates.items():
        print(f"{name:36} {value:9,.0f} {f'{TARGET:,.0f}' if name in IDS else '':>9}")
    reporting.write(chosen.out, "environments", {"steps_per_second": rates})


if __name__ == "__main__":
    main()
