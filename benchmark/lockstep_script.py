#!/usr/bin/env python3
"""The existing policy-gradient script, unchanged: how fast it is in lock-step, and how it learns by period.

    ./ws python3 benchmark/lockstep_script.py [SCRIPT] [--dt 0.004 0.008] [--seeds 0 1] [--out FOLDER]

Runs it once in real time, then in lock-step for each seed and period, one after the other, and writes
lockstep_script.json after each run. Steps per second are those within episodes: what lies between them is
the script's own learning, which is quadratic in the length of an episode.
"""

import argparse
import sys
import tempfile
from collections import defaultdict
from pathlib import Path
from typing import Any

import reporting
from existing_script import SCRIPT, run

PERIODS = (0.001, 0.002, 0.004, 0.008, 0.016)  # [s]


def table(real: dict[str, Any] | None, runs: list[dict[str, Any]]) -> str:
    """A row for each period: means over seeds."""
    spans = list(runs[0]["mean_lengths"])
    lines = [
        f"| `--dt` | seeds | {' | '.join(spans)} | steps/s | times real time |",
        "|---|---|" + "---|" * (len(spans) + 2),
    ]
    if real:
        means = " | ".join(str(real["mean_lengths"].get(span, "")) for span in spans)
        lines.append(f"| real time | | {means} | {real['steps_per_second']} | 1 |")
    by_period: dict[float, list[dict[str, Any]]] = defaultdict(list)
    for each in runs:
        by_period[each["dt"]].append(each)
    for period, group in sorted(by_period.items()):
        means = " | ".join(
            f"{sum(each['mean_lengths'][span] for each in group) / len(group):.0f}" for span in spans
        )
        speed = sum(each["steps_per_second"] for each in group) / len(group)
        times = f"{speed / real['steps_per_second']:.1f}" if real else ""
        lines.append(f"| {period:g} s | {len(group)} | {means} | {speed:.0f} | {times} |")
    return "\n".join(lines)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("script", nargs="?", type=Path, default=SCRIPT)
    parser.add_argument("--episodes", type=int, default=200, help="in lock-step")
    parser.add_argument("--real-episodes", type=int, default=60, help="in real time; 0 for none")
    parser.add_argument("--dt", type=float, nargs="+", default=PERIODS, metavar="SECONDS")
    parser.add_argument("--seeds", type=int, nargs="+", default=[0, 1])
    parser.add_argument("--out", type=Path, default=Path("runs/benchmark"), help="folder for JSON")
    chosen = parser.parse_args()
    if not chosen.script.is_file():
        parser.error(f"no such file: {chosen.script}")
    script = chosen.script.resolve()
    real = None
    if chosen.real_episodes:
        real = run([sys.executable, script], chosen.real_episodes, _folder())
    runs = []
    for seed in chosen.seeds:
        for period in chosen.dt:
            options = ["--seed", str(seed), "--dt", str(period)]
            command = ["rosrun", "cartpole", "lockstep.py", *options, script]
            result = run(command, chosen.episodes, _folder())
            runs.append({"seed": seed, "dt": period, **result})
            reporting.write(chosen.out, "lockstep_script", {"real_time": real, "lockstep": runs})
            print(table(real, runs), flush=True)
    return 0


def _folder() -> Path:
    return Path(tempfile.mkdtemp(prefix="lockstep_script_"))


if __name__ == "__main__":
    sys.exit(main())
