#!/usr/bin/env python3
"""The physics engines against the cart-pole's equations of motion, and how fast they step.

    ./ws extras python3 benchmark/engines.py [--out FOLDER] [--ticks 20000] [--rounds 5]

Accuracy doesn't depend on the machine; ticks a second do. Prints tables and writes engines.json.
"""

import math
import statistics
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[1] / "test"))
import reporting
from support.robots import engine_runs as runs

from robot_sim.physics.engine import Engine
from robot_sim.physics.engines import make_engine
from robot_sim.physics.world import World
from robot_sim.simulator import Simulator

NewEngine = Callable[[], Engine]
ENGINES: dict[str, NewEngine] = {
    "PyBullet": make_engine,
    "MuJoCo": partial(make_engine, "mujoco"),
    "MuJoCo, RK4": runs.runge_kutta,
}
STEPS = (0.001, 0.0005)  # [s]
SWING_TIME = 20.0  # [s]


def relative(found: float, wanted: float) -> float:
    return found / wanted - 1.0


MEASURES: dict[str, Callable[[NewEngine, float], float]] = {
    "growth rate of the upright pole, relative": lambda engine, step: relative(
        runs.growth_rate(engine, step), runs.rate()
    ),
    "period of the hanging pole, relative": lambda engine, step: relative(
        runs.hanging_period(engine, step), 2.0 * math.pi / runs.rate()
    ),
    "pole falls from 0.1 rad for 1 s [rad]": runs.fall_error,
    "cart pushed by 0.2 N for 1 s [m]": runs.push_error,
    "position controller, 0.5 s [m]": runs.loop_error,
    "energy, 20 s of a swing by 2 rad, of m g l": lambda engine, step: runs.energy_error(
        engine, step, SWING_TIME
    )[0],
    "drift of its mean, of m g l": lambda engine, step: runs.energy_error(engine, step, SWING_TIME)[1],
}


def accuracy() -> dict[str, dict[str, list[float]]]:
    """Errors by measure and engine, one for each of STEPS."""
    return {
        name: {engine: [measure(make, step) for step in STEPS] for engine, make in ENGINES.items()}
        for name, measure in MEASURES.items()
    }


def difference(step: float = STEPS[0]) -> float:
    """Largest difference [rad, rad/s, m, m/s] of the engines' states in 1 s of the falling pole."""
    a, b = (runs.Run(ENGINES[name](), step).track(1.0) for name in ("PyBullet", "MuJoCo"))
    return float(abs(a - b).max())


def order(errors: list[float]) -> float:
    """Order of convergence; NaN where rounding is all that is left."""
    coarse, fine = abs(errors[0]), abs(errors[1])
    return math.log2(coarse / fine) if fine > 1e-14 else math.nan


def speeds(count: int, rounds: int) -> dict[str, dict[str, float]]:
    """Thousands of steps and of ticks a second by engine; the median of rounds taken in turn."""
    taken: dict[str, dict[str, list[float]]] = {
        name: {"bare step": [], "tick with a position controller": []} for name in ENGINES
    }
    for _ in range(rounds):
        for name, make in ENGINES.items():
            taken[name]["bare step"].append(_steps(make, count))
            taken[name]["tick with a position controller"].append(_ticks(make, count))
    return {
        name: {what: statistics.median(values) for what, values in rows.items()}
        for name, rows in taken.items()
    }


def _steps(make: NewEngine, count: int) -> float:
    run = runs.Run(make(), STEPS[0], runs.SWING)
    begin = time.perf_counter()
    for _ in range(count):
        run.world.step()
    taken = time.perf_counter() - begin
    run.world.close()
    return 1e-3 * count / taken


def _ticks(make: NewEngine, count: int) -> float:
    sim = Simulator(World(make(), time_step=STEPS[0]), lockstep=True)
    runs.control(sim)
    begin = time.perf_counter()
    with sim.lock:
        sim.advance(count)
    taken = time.perf_counter() - begin
    sim.world.close()
    return 1e-3 * count / taken


def report(errors: dict[str, dict[str, list[float]]], fast: dict[str, dict[str, float]]) -> None:
    print(f"{'error against the equations of motion':44} {'engine':12} "
          f"{'1 ms':>10} {'0.5 ms':>10} {'order':>6}")  # fmt: skip
    for name, rows in errors.items():
        for engine, values in rows.items():
            print(f"{name:44} {engine:12} {values[0]:10.1e} {values[1]:10.1e} {order(values):6.2f}")
    print(f"{'thousands a second':44} " + " ".join(f"{engine:>12}" for engine in fast))
    for what in next(iter(fast.values())):
        print(f"{what:44} " + " ".join(f"{rows[what]:12.0f}" for rows in fast.values()))


def main() -> None:
    options = reporting.options(__doc__ or "", ticks=20_000, rounds=5)
    errors, apart = accuracy(), difference()
    fast = speeds(options.ticks, options.rounds)
    report(errors, fast)
    print(f"PyBullet and MuJoCo differ by {apart:.1e} at most in the falling pole at 1 ms")
    results = {"steps": STEPS, "errors": errors, "difference": apart, "thousands a second": fast}
    reporting.write(options.out, "engines", results)


if __name__ == "__main__":
    main()
