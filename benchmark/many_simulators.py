#!/usr/bin/env python3
"""Many simulators and one client over ROS: steps a second of all together, against those of one.

    ./ws python3 benchmark/many_simulators.py [--out FOLDER] [--most 16] [--seconds 1.0] [--rounds 5]

A step is 8 physics steps of 1 ms of the cart-pole with its position controller, resets included. The same
simulators are measured 1, 2, 4, ... at a time, all numbers in each round one after the other; ratios are
medians over rounds of what was measured in the same round. Processor time is the client's own, with all that
its environments do, and the simulators' own. Then it says where the processor time of a step goes with as
many simulators as cores, and how much of the cores that is. Prints tables and writes many_simulators.json.
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
    kernel: float  # what of both was spent in the kernel [us], as it samples that
    busy: float  # cores that both used together
    others: float  # cores that the rest of the machine used


def measured(env: gymnasium.vector.VectorEnv[Any, Any, Any], seconds: float) -> Measured:
    """What random actions in all environments of a vector give and cost in some time."""
    env.action_space.seed(0)
    actions = [env.action_space.sample() for _ in range(BATCH)]
    env.reset(seed=0)  # its robots were another vector's meanwhile
    for action in actions:  # warms up
        env.step(action)
    backends = [robot.backend for robot in env.unwrapped.envs]  # type: ignore[attr-defined]
    pids = [backend.simulator.pid for backend in backends if hasattr(backend, "simulator")]
    before, machine = used([os.getpid(), *pids]), used_by_all()
    client = time.process_time()
    steps, begin = 0, time.perf_counter()
    while (passed := time.perf_counter() - begin) < seconds:
        for action in actions:
            env.step(action)
        steps += BATCH * env.num_envs
    client = time.process_time() - client
    both, kernel = (now - then for now, then in zip(used([os.getpid(), *pids]), before, strict=True))
    others = used_by_all() - machine - both
    each = 1e6 / steps
    return Measured(
        steps / passed,
        each * client,
        each * max(0.0, both - client),
        each * kernel,
        both / passed,
        max(0.0, others) / passed,
    )


def used(pids: list[int]) -> tuple[float, float]:
    """Processor time of processes [s]: all of it, and in the kernel."""
    whole = kernel = 0
    for pid in pids:
        with open(f"/proc/{pid}/stat", encoding="utf-8") as file:
            fields = file.read().rpartition(")")[2].split()
        whole += int(fields[11]) + int(fields[12])
        kernel += int(fields[12])
    return TICK * whole, TICK * kernel


def used_by_all() -> float:
    """Processor time of all processes of the machine [s]."""
    with open("/proc/stat", encoding="utf-8") as file:
        user, nice, system, _, _, hard, soft = map(int, file.readline().split()[1:8])
    return TICK * (user + nice + system + hard + soft)


def of_ticks(env: gymnasium.vector.VectorEnv[Any, Any, Any], actions: int = 2000) -> float:
    """Processor time [us] of the ticks of a step in this process: engine, controllers and limits."""
    env.reset(seed=0)
    robot = env.unwrapped.envs[0]  # type: ignore[attr-defined]
    commands = robot.state.commands
    begin = time.process_time()
    for _ in range(actions):
        robot.backend.act(commands)
    return 1e6 * (time.process_time() - begin) / actions


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
    ticks = of_ticks(here)
    restarts = sum(robot.backend.restarts for robot in robots)
    everyone.close()
    report(chosen, taken, {"seconds_to_start": began, "restarts": restarts, "ticks": ticks})


def report(chosen: Any, taken: dict[int, list[Measured]], told: dict[str, float]) -> None:
    """Prints the table, and writes it."""
    print(f"{chosen.most} simulators were there after {told['seconds_to_start']:.1f} s")
    print(f"{'simulators':20} {'steps/s':>9} {'to one':>7} {'client us':>10} {'simulator us':>13}")
    rows = {}
    for count, values in taken.items():
        ratio = statistics.median(each.rate / one.rate for each, one in zip(values, taken[1], strict=True))
        middle = Measured(*map(statistics.median, zip(*values, strict=True)))
        rows[count] = {**middle._asdict(), "to_one": ratio}
        name = str(count) if count else "none: in this process"
        print(f"{name:20} {middle.rate:9,.0f} {ratio:7.2f} {middle.client:10.1f} {middle.simulator:13.1f}")
    cores = len(os.sched_getaffinity(0))
    if cores in rows:
        print(f"as many as cores ({cores}): {rows[cores]['to_one']:.2f}, target {TARGET}")
        budget(rows[0], rows[cores], told["ticks"], cores)
    least = min(row["client"] for count, row in rows.items() if count)
    print(f"one client saturates at {1e6 / least:,.0f} steps/s; faults: {told['restarts']:.0f}")
    reporting.write(chosen.out, "many_simulators", {"simulators": rows, "target": TARGET, **told})


def budget(here: dict[str, float], there: dict[str, float], ticks: float, cores: int) -> None:
    """Prints what the processor time of a step is spent on."""
    alone = max(0.0, here["client"] - ticks)  # environments' own, also without ROS
    whole = there["client"] + there["simulator"]
    for what, value in {
        "ticks": ticks,
        "the rest of the simulator, its part of the kernel included": there["simulator"] - ticks,
        "environment and vector, as in one process": alone,
        "the rest of the client, its part of the kernel included": there["client"] - alone,
        "both together": whole,
        "of that in the kernel": there["kernel"],
    }.items():
        print(f"  {what:60} {value:7.1f} us")
    print(
        f"  {there['busy']:.2f} of {cores} cores were busy with that, {there['others']:.2f} with others; "
        f"full cores would make {cores * 1e6 / whole:,.0f} steps/s"
    )


if __name__ == "__main__":
    main()
