#!/usr/bin/env python3
"""Many simulators and one client over ROS: steps a second of all together, against those of one.

    ./ws python3 benchmark/many_simulators.py [--out FOLDER] [--most 16] [--seconds 1.0] [--rounds 5]

A step is 8 physics steps of 1 ms of the cart-pole with its position controller, resets included. The same
simulators are measured 1, 2, 4, ... at a time, all numbers in each round one after the other; ratios are
medians over rounds of what was measured in the same round. Processor time is the client's own, with all that
its environments do, and the simulators' own. Prints a table and writes many_simulators.json.
"""

import os
import statistics
import time
from typing import Any, NamedTuple

import gymnasium
import reporting

import cartpole  # noqa: F401 - registers the environments
from robot_envs.environment import RobotEnv
from robot_envs.vector import RobotVectorEnv

IDENTIFIER = "cartpole/Balance-v0"
BATCH = 50  # steps of each between looks at the clock
TICK = 1.0 / os.sysconf("SC_CLK_TCK")  # [s], in which the kernel counts processor time
TARGET = 1.8  # times one simulator's steps/s, with as many as there are cores


class Measured(NamedTuple):
    """Steps of all environments together, and what one step costs."""

    rate: float  # [1/s]
    client: float  # processor time [us]
    simulator: float  # the same


def measured(env: gymnasium.vector.VectorEnv[Any, Any, Any], seconds: float) -> Measured:
    """What random actions in all environments of a vector give and cost in some time."""
    env.action_space.seed(0)
    actions = [env.action_space.sample() for _ in range(BATCH)]
    env.reset(seed=0)  # its robots were another vector's meanwhile
    for action in actions:  # warms up
        env.step(action)
    backends = [robot.backend for robot in env.unwrapped.envs]  # type: ignore[attr-defined]
    pids = [backend.simulator.pid for backend in backends if hasattr(backend, "simulator")]
    before, client = sum(map(used, pids)), time.process_time()
    steps, begin = 0, time.perf_counter()
    while (passed := time.perf_counter() - begin) < seconds:
        for action in actions:
            env.step(action)
        steps += BATCH * env.num_envs
    client = time.process_time() - client
    simulators = sum(map(used, pids)) - before
    return Measured(steps / passed, 1e6 * client / steps, 1e6 * simulators / steps)


def used(pid: int) -> float:
    """A process's processor time [s]."""
    with open(f"/proc/{pid}/stat", encoding="utf-8") as file:
        fields = file.read().rpartition(")")[2].split()
    return TICK * (int(fields[11]) + int(fields[12]))


def part(robots: list[RobotEnv]) -> RobotVectorEnv:
    """A vector of environments that are there already."""
    following = iter(robots)
    return RobotVectorEnv(len(robots), lambda backend: next(following), backend="ros")


def main() -> None:
    chosen = reporting.options(__doc__ or "", most=16, seconds=1.0, rounds=5)
    here = gymnasium.make_vec(IDENTIFIER, 1)
    began = time.perf_counter()
    everyone = gymnasium.make_vec(IDENTIFIER, chosen.most, backend="ros")
    began = time.perf_counter() - began
    robots = everyone.unwrapped.envs  # type: ignore[attr-defined]
    counts = [2**power for power in range(chosen.most.bit_length())]
    vectors = {0: here, **{count: part(robots[:count]) for count in counts}}
    taken: dict[int, list[Measured]] = {count: [] for count in vectors}
    for _ in range(chosen.rounds):
        for count, vector in vectors.items():
            taken[count].append(measured(vector, chosen.seconds))
    restarts = sum(robot.backend.restarts for robot in robots)
    everyone.close()
    report(chosen, taken, {"seconds_to_start": began, "restarts": restarts})


def report(chosen: Any, taken: dict[int, list[Measured]], told: dict[str, float]) -> None:
    """Prints the table, and writes it."""
    print(f"{chosen.most} simulators were there after {told['seconds_to_start']:.1f} s")
    print(f"{'simulators':20} {'steps/s':>9} {'to one':>7} {'client us':>10} {'simulator us':>13}")
    rows = {}
    for count, values in taken.items():
        ratio = statistics.median(
            each.rate / one.rate for each, one in zip(values, taken[1], strict=True)
        )
        middle = Measured(*map(statistics.median, zip(*values, strict=True)))
        rows[count] = {**middle._asdict(), "to_one": ratio}
        name = str(count) if count else "none: in this process"
        print(
            f"{name:20} {middle.rate:9,.0f} {ratio:7.2f} {middle.client:10.1f} {middle.simulator:13.1f}"
        )
    cores = len(os.sched_getaffinity(0))
    if cores in rows:
        print(f"as many as cores ({cores}): {rows[cores]['to_one']:.2f}, target {TARGET}")
    least = min(row["client"] for count, row in rows.items() if count)
    print(f"one client saturates at {1e6 / least:,.0f} steps/s; faults: {told['restarts']:.0f}")
    reporting.write(chosen.out, "many_simulators", {"simulators": rows, "target": TARGET, **told})


if __name__ == "__main__":
    main()
