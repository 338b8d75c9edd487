#!/usr/bin/env python3
"""What one worker and two come to, measured; and what 8, 64 and 512 would, foretold from measured times.

    ./ws extras python3 benchmark/scaling.py [--backend bullet|ros-own] [--env-id ID]
                                             [--job-seconds 60] [--out FOLDER]

Measures on this machine, with a local cluster of Ray's: a worker's step, an actor's call that carries an
episode, the learner's work, the start of a worker (with its simulator, over ROS) and a job of a benchmark. A
simulation of events (foretelling.py) makes of these times what N workers would come to, each on a core of
its own. For one and two workers that is compared with a real training and real jobs. It takes two free cores,
of which all ratios tell nothing under load.
"""

import os
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path

import reporting
import torch
from cluster_times import calls, line, options, policy_of, real_rollouts, run_jobs, sample
from foretelling import Foretold, JobTimes, RolloutTimes, jobs, most_steps, rollouts

import cartpole  # noqa: F401 - registers the environments
from rl_workbench.tools.jobs.machines import Machines, ThisMachine
from rl_workbench.training.cli import PROGRAM
from rl_workbench.training.cluster.joining import joined

MEASURED, FORETOLD = (1, 2), (1, 2, 8, 64, 512)
TO_LEARN = 10_000_000  # steps of a training that is foretold
JOBS = 1000  # of a benchmark that is foretold
HOUR = 3600.0


def compared(kind: str, foretold: float, measured: float, unit: str) -> str:
    return f"{kind:24} {foretold:10,.2f} {measured:10,.2f} {unit:8} {foretold / measured:6.2f}"


def row(workers: int, rolled: Foretold, start: float, done: Foretold) -> str:
    learned = start + TO_LEARN / rolled.rate
    return (
        f"| {workers} | {rolled.rate:,.0f} | {rolled.busy:.0%} | {learned / HOUR:.2f} h "
        f"| {done.seconds / HOUR:.2f} h | {done.busy:.1%} |"
    )


def main() -> None:
    chosen = reporting.options(
        __doc__ or "",
        env_id="cartpole/SwingUp-v0",
        backend="bullet",
        job_seconds=60.0,
    )
    env_id, backend = chosen.env_id, chosen.backend
    torch.set_num_threads(1)
    print(f"load {os.getloadavg()[0]:.1f}, {env_id}, backend {backend}")
    found = sample(options(env_id, backend))
    step, episode = line(found.lengths, found.seconds)
    lines = []
    alone, _ = run_jobs(lambda folder: ThisMachine(1, PROGRAM), 1)
    with joined("local", "the same command begins anew") as cluster:
        call, latency = calls(cluster, found, policy_of(options(env_id, backend)))
        real = {each: real_rollouts(cluster, options(env_id, backend, each)) for each in MEASURED}
        rolling = RolloutTimes(step, episode, call, latency, real[1].learn_step)
        for workers, measured in real.items():
            foretold = rollouts(rolling, workers, found.lengths).rate
            lines.append(compared(f"{workers} workers play", foretold, measured.rate, "steps/s"))

        from rl_workbench.tools.jobs.cluster.nodes import RayNodes

        def nodes(at_once: int) -> Callable[[Path], Machines]:
            return lambda folder: RayNodes(cluster, folder, PROGRAM, at_once, None)

        one, driver = run_jobs(nodes(1), 2)
        working = JobTimes(alone, max(one / 2 - alone - driver, 0.0), driver)
        two, _ = run_jobs(nodes(2), 4)
        lines.append(compared("4 jobs, 2 workers", jobs(working, 2, 4).seconds, two, "s"))
    print("measured times [s]:")
    times = asdict(rolling) | asdict(working) | {"start_worker": real[1].start}
    print("\n".join(f"  {name:14} {value:.6f}" for name, value in times.items()))
    print(f"\n{'':24} {'foretold':>10} {'measured':>10} {'':8} {'ratio':>6}", *lines, sep="\n")
    print(f"\nForetold, not measured ({env_id}, backend {backend}):\n")
    wanted = f"{JOBS} jobs of {chosen.job_seconds:g} s"
    print(
        f"| workers | steps/s | driver at work | {TO_LEARN:,} steps | {wanted} | driver at work |"
    )
    print("|---|---|---|---|---|---|")
    longer = replace(working, job=chosen.job_seconds)
    table = {
        workers: (rollouts(rolling, workers, found.lengths), jobs(longer, workers, JOBS))
        for workers in FORETOLD
    }
    for workers, (rolled, done) in table.items():
        print(row(workers, rolled, real[1].start, done))
    print(
        f"\nThe driver takes in and learns from {most_steps(rolling, found.lengths):,.0f} steps/s at most."
    )
    print(
        f"It keeps {(longer.job + longer.begin) / longer.driver:,.0f} workers busy with such jobs."
    )
    reporting.write(chosen.out, f"scaling_{backend}", {
        "times": times,
        "foretold": {workers: [each._asdict() for each in pair] for workers, pair in table.items()},
        "compared": lines,
    })  # fmt: skip


if __name__ == "__main__":
    main()
