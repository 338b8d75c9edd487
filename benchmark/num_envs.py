#!/usr/bin/env python3
"""Steps a second of a training over ROS with --num-envs 1 and 2, by turns.

    ./ws python3 benchmark/num_envs.py [--out FOLDER] [--steps 40000] [--rounds 3] [--most 2]

The main job's first steps (REINFORCE on the cart-pole), each environment in a simulator of its own; all of
the training but its evaluation at the end counts, the simulators' start doesn't. Ratios are medians over
rounds of what was measured in the same round; processor time is this process's. Prints a table and writes
num_envs.json.
"""

import json
import statistics
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

import reporting

import cartpole  # noqa: F401 - registers the environments
from rl_workbench.starting import Interrupt
from rl_workbench.training.algorithms import algorithm
from rl_workbench.training.train import choose
from rl_workbench.training.training import Training

FLAGS = ["--env-id=cartpole/Balance-v0", "--train-env-kwargs=backend=ros-own", "--stop-at-length=0",
         "--eval-env-kwargs=backend=bullet", "--eval-episodes=1", "--episodes=0"]  # fmt: skip


class Measured(NamedTuple):
    """Of one training."""

    rate: float  # steps of all environments [1/s]
    cost: float  # processor time of a step [us]


def measured(count: int, steps: int) -> Measured:
    """A training in so many environments."""
    flags = [*FLAGS, f"--num-envs={count}", f"--total-timesteps={steps}"]
    with tempfile.TemporaryDirectory() as folder:
        training = Training(choose(algorithm("reinforce"), flags), Path(folder), Interrupt())
        began = time.process_time()
        training.run()
        used = time.process_time() - began
        summary = json.loads((Path(folder) / "summary.json").read_text(encoding="utf-8"))
    return Measured(summary["steps"] / summary["seconds"], 1e6 * used / summary["steps"])


def main() -> None:
    chosen = reporting.options(__doc__ or "", steps=40_000, rounds=3, most=2)
    counts = range(1, chosen.most + 1)
    rounds = [[measured(count, chosen.steps) for count in counts] for _ in range(chosen.rounds)]
    results = {}
    for index, count in enumerate(counts):
        results[count] = {
            "steps/s": round(statistics.median(each[index].rate for each in rounds)),
            "ratio": round(statistics.median(each[index].rate / each[0].rate for each in rounds), 2),
            "us of processor": round(statistics.median(each[index].cost for each in rounds)),
        }
        print(f"--num-envs {count}: {results[count]}")
    reporting.write(chosen.out, "num_envs", results)


if __name__ == "__main__":
    main()
