#!/usr/bin/env python3
"""What workers on a cluster of Ray's give a training: steps per second of 1, 2 and 4, and the cost of a call.

    ./ws extras
    ./ws python3 benchmark/rollouts.py [--out FOLDER] [--steps 2048] [--rounds 10] [--inside 1]

PPO's rollouts in cartpole/Balance-v0, each worker's robot in its own process (--inside 0: in a simulator
beside it). All pools are alive and take turns, so that a busy machine slows all of them: read the ratios.
Prints a table and writes rollouts.json.
"""

import os
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import reporting
import torch

import cartpole  # noqa: F401 - registers the environments
from rl_workbench.training.algorithms import algorithm
from rl_workbench.training.cluster.joining import QUIET
from rl_workbench.training.options.training_options import TrainingOptions, make_options
from rl_workbench.training.run.progress import warn
from rl_workbench.training.sb3.fragments import FragmentPlayer

COUNTS = (1, 2, 4)
CALLS = 2000
ENVIRONMENT = "cartpole/Balance-v0"


class Answering:
    """An actor that does nothing else."""

    def answer(self, value: Any) -> Any:
        return value


def training(num_envs: int, steps: int, inside: int) -> TrainingOptions:
    backend = "bullet" if inside else "ros-own"
    values = {"env_id": ENVIRONMENT, "env_kwargs": {"backend": backend},
              "total_timesteps": 1, "num_envs": num_envs, "n_steps": steps, "batch_size": steps}  # fmt: skip
    return make_options(algorithm("ppo"), values)


def cost_of_a_call(ray: Any) -> dict[str, float]:
    """Medians [ms]: of an empty call, and of one that carries 100 kB there and back."""
    actor = ray.remote(Answering).remote()
    found = {}
    for name, value in (("empty", None), ("of 100 kB", np.zeros(12_500))):
        ray.get(actor.answer.remote(value))
        times = []
        for _ in range(CALLS):
            begin = time.perf_counter()
            ray.get(actor.answer.remote(value))
            times.append(time.perf_counter() - begin)
        found[name] = 1e3 * float(np.median(times))
    ray.kill(actor)
    return found


def measure(plays: dict[str, Callable[[], int]], rounds: int) -> dict[str, float]:
    """Steps per second of each, all by turns."""
    steps, seconds = dict.fromkeys(plays, 0), dict.fromkeys(plays, 0.0)
    for play in plays.values():
        play()  # the first part also makes the environment
    for _ in range(rounds):
        for name, play in plays.items():
            begin = time.perf_counter()
            steps[name] += play()
            seconds[name] += time.perf_counter() - begin
    return {name: steps[name] / seconds[name] for name in plays}


def in_this_process(options: TrainingOptions, policy: Any) -> Callable[[], int]:
    player, state = FragmentPlayer(options, 0), None

    def play() -> int:
        nonlocal state
        state = player.play(policy, state).state
        return options.hyperparameters.n_steps

    return play


def by_workers(options: TrainingOptions, pool: Any, policy: Any) -> Callable[[], int]:
    count = options.run.num_envs
    states: list[Any] = [None] * count

    def play() -> int:
        states[:] = [each.state for each in pool.play(policy, states, lambda: False)]
        return count * options.hyperparameters.n_steps

    return play


def main() -> None:
    given = reporting.options(__doc__ or "", steps=2048, rounds=10, inside=1)
    torch.set_num_threads(1)
    for name, value in {**QUIET, "RAY_AUTH_MODE": "disabled", "RAY_worker_niceness": "0"}.items():
        os.environ.setdefault(name, value)
    import ray  # reads these variables

    from rl_workbench.training.cluster.nodes import Cluster
    from rl_workbench.training.rollouts.workers import Workers
    from rl_workbench.training.sb3.model import make_model

    # As many processors as there are workers, whatever this machine has.
    ray.init(num_cpus=sum(COUNTS), include_dashboard=False, log_to_driver=False)
    cluster = Cluster(ray, warn)
    cluster.update(patience=60.0)
    alone = training(1, given.steps, given.inside)
    model = make_model(alone)
    policy = model.policy.state_dict()
    model.get_env().close()
    calls = cost_of_a_call(ray)
    plays = {"this process": in_this_process(alone, policy)}
    pools = []
    try:
        for count in COUNTS:
            options = training(count, given.steps, given.inside)
            pools.append(Workers(cluster, options, warn))
            plays[f"{count} workers"] = by_workers(options, pools[-1], policy)
        speeds = measure(plays, given.rounds)
    finally:
        for pool in pools:
            pool.close()
        ray.shutdown()
    for name, milliseconds in calls.items():
        print(f"a call {name}: {milliseconds:.2f} ms")
    base = speeds["this process"]
    print(f"{'':14} {'steps/s':>8} {'to one process':>15}   ({given.steps} steps a fragment)")
    for name, speed in speeds.items():
        print(f"{name:14} {speed:8.0f} {speed / base:15.2f}")
    results = {"call_ms": calls, "steps_per_second": speeds, "fragment": given.steps}
    reporting.write(given.out, "rollouts", results)


if __name__ == "__main__":
    main()
