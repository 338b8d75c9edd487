#!/usr/bin/env python3
"""What simulators of one's own take: seconds to start and end side by side, memory, seconds to be replaced.

    ./ws python3 benchmark/own_simulators.py [--out FOLDER] [--most 16] [--steps 500]

Starts 1, 2, 4, ... up to `most`. Memory is each one's: master, simulator and their
supervisor together, what processes share counted in parts (Pss). Replaced: one is killed after `steps` steps
of an episode, and brought back to the same state. Prints a table and writes own_simulators.json.
"""

import os
import signal
import time
from pathlib import Path
from typing import Any

import gymnasium
import psutil
import reporting

import cartpole  # noqa: F401 - registers the environments
from robot_envs.backends.backend import side_by_side

MEGA = 1e6


def memory(pid: int) -> float:
    """A process's [MB], its part of what is shared."""
    lines = Path(f"/proc/{pid}/smaps_rollup").read_text(encoding="ascii").splitlines()
    (size,) = (int(line.split()[1]) * 1024 for line in lines if line.startswith("Pss:"))
    return size / MEGA


def processes(pid: int) -> list[int]:
    """The process ids of a simulator, its master and their supervisor."""
    supervisor = psutil.Process(pid).parent()
    assert supervisor is not None
    return [supervisor.pid, *(each.pid for each in supervisor.children(recursive=True))]


def measure(count: int, steps: int) -> dict[str, float]:
    """Seconds and megabytes with so many."""
    begin = time.monotonic()
    with side_by_side(count):
        envs: list[Any] = [
            gymnasium.make("cartpole/Balance-v0", backend="ros-own", max_steps=2 * steps).unwrapped
            for _ in range(count)
        ]
    started = time.monotonic()
    worlds = [env.backend for env in envs]
    taken = [sum(map(memory, processes(world.simulator.pid))) for world in worlds]
    world = worlds[0]
    envs[0].reset(seed=0)
    commands = dict.fromkeys(envs[0].scene.ports, 0.0)
    for _ in range(steps):
        world.act(commands)
    os.kill(world.simulator.pid, signal.SIGKILL)
    killed = time.monotonic()
    world.act(commands)
    assert world.restarts == 1
    replaced = time.monotonic()
    with side_by_side(count):
        for env in envs:
            env.close()
    return {
        "start [s]": started - begin,
        "end [s]": time.monotonic() - replaced,
        "memory of each [MB]": sum(taken) / count,
        "replaced [s]": replaced - killed,
    }


def main() -> None:
    chosen = reporting.options(__doc__ or "", most=16, steps=500)
    results = {}
    count = 1
    while count <= chosen.most:
        results[str(count)] = found = measure(count, chosen.steps)
        if count == 1:
            print(f"{'simulators':>10}", *(f"{name:>20}" for name in found))
        print(f"{count:10}", *(f"{value:20.1f}" for value in found.values()), flush=True)
        count *= 2
    reporting.write(chosen.out, "own_simulators", results)


if __name__ == "__main__":
    main()
