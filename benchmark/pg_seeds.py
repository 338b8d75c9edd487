#!/usr/bin/env python3
"""How reliably pg_train.py learns: several seeds, each on a master and a simulator of its own.

    ./ws python3 benchmark/pg_seeds.py [--seeds 0 1 2 3 4] [--episodes 600] [--parallel 1]
        [--out DIR] [any other flag of pg_train.py]

Prints a table with every seed and writes pg_seeds.json; the runs themselves lie in DIR/runs.
"""

import argparse
import datetime
import json
import os
import platform
import socket
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

LAST = 60  # [episodes]
RECENT = 20  # [episodes]; the training's own, for --stop-at
SOLVED = 2400  # [steps] of 3000


def train(seed: int, episodes: int, folder: Path, extra: list[str]) -> dict[str, Any]:
    """Runs one training; returns its row of the table."""
    with socket.create_server(("127.0.0.1", 0)) as probe:
        master = f"http://127.0.0.1:{probe.getsockname()[1]}"
    run = folder / f"seed_{seed}"
    command = ["rosrun", "cartpole", "pg_train.py"]
    flags = [f"--seed={seed}", f"--episodes={episodes}", f"--run-dir={run}", *extra]
    with (folder / f"seed_{seed}.log").open("w") as log:
        code = subprocess.call(
            [*command, *flags],
            env=os.environ | {"ROS_MASTER_URI": master},
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=subprocess.STDOUT,
        )
    if code:
        sys.exit(f"seed {seed} ended with exit code {code}; see {log.name}")
    row = result(seed, json.loads((run / "summary.json").read_text()))
    length = row["mean_length_last_60"]
    print(f"seed {seed}: {length} in {row['seconds']} s", file=sys.stderr, flush=True)
    return row


def result(seed: int, summary: dict[str, Any]) -> dict[str, Any]:
    lengths, greedy = summary["lengths"], summary["evaluation"]["lengths"]
    return {
        "seed": seed,
        "episodes": len(lengths),
        "mean_length_last_60": round(float(np.mean(lengths[-LAST:])), 1),
        "mean_length_last_20": round(float(np.mean(lengths[-RECENT:])), 1),
        "first_20_episodes_above_1000": first_above(lengths, 1000),
        "greedy_mean_length": round(float(np.mean(greedy)), 1),
        "steps": summary["steps"],
        "seconds": round(summary["seconds"], 1),
        "steps_per_second": round(summary["steps"] / summary["seconds"]),
        "lengths": lengths,
    }


def first_above(lengths: list[int], limit: float, window: int = 20) -> int | None:
    """The episode at which the mean of the last `window` first exceeds a limit; None: never."""
    for end in range(window, len(lengths) + 1):
        if sum(lengths[end - window : end]) > limit * window:
            return end
    return None


def table(rows: list[dict[str, Any]]) -> str:
    columns = [name for name in rows[0] if name != "lengths"]
    lines = [" | ".join(columns), " | ".join("---" for _ in columns)]
    lines += [" | ".join(str(row[name]) for name in columns) for row in rows]
    text = "\n".join(f"| {line} |" for line in lines)
    counts = [
        f"{sum(row[name] >= SOLVED for row in rows)} of {len(rows)} seeds: {name} at least {SOLVED} of 3000"
        for name in ("mean_length_last_60", "mean_length_last_20")
    ]
    return "\n".join([text, *counts])


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--seeds", type=int, nargs="+", default=[0, 1, 2, 3, 4])
    parser.add_argument("--episodes", type=int, default=600)
    parser.add_argument("--parallel", type=int, default=1, help="trainings at a time")
    parser.add_argument("--out", type=Path, default=Path("pg_seeds"))
    chosen, extra = parser.parse_known_args()  # the rest is for pg_train.py
    runs = (chosen.out / "runs").resolve()
    runs.mkdir(parents=True)
    with ThreadPoolExecutor(chosen.parallel) as pool:
        jobs = [pool.submit(train, seed, chosen.episodes, runs, extra) for seed in chosen.seeds]
        rows = [job.result() for job in jobs]
    content = {
        "command": "benchmark/pg_seeds.py",
        "episodes": chosen.episodes,
        "parallel": chosen.parallel,
        "flags": extra,
        "date": datetime.date.today().isoformat(),
        "machine": f"{platform.platform()}, {os.cpu_count()} cores",
        "seeds": rows,
    }
    (chosen.out / "pg_seeds.json").write_text(json.dumps(content, indent=1) + "\n")
    print(table(rows))
    return 0


if __name__ == "__main__":
    sys.exit(main())
