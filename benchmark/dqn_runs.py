"""Trainings of dqn_train.py for the benchmarks: each a process of its own, like a user's."""

import json
import os
import resource
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from cartpole.training.dqn_policy import load_policy
from cartpole.training.evaluation import run_greedily

SCRIPT = Path(__file__).resolve().parent.parent / "scripts/dqn_train.py"
TEST_SEED = 5_000_000  # other episodes than those of training and evaluation
EPISODES = 100
SOLVED = 475.0
# One core, as said; the networks are too small to gain by more.
ENVIRONMENT = os.environ | {"OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}


def train(folder: Path, seed: int, *flags: str) -> dict[str, Any]:
    """Runs one training; returns its summary, with the seconds of the whole command.

    On a machine that does other work as well, its processor's seconds tell more than the clock's.
    """
    run, began, used = folder / f"seed_{seed}", time.monotonic(), _cpu_seconds()
    command = [sys.executable, str(SCRIPT), f"--seed={seed}", f"--run-dir={run}", *flags]
    with (folder / f"seed_{seed}.log").open("w") as log:
        code = subprocess.call(command, env=ENVIRONMENT, stdout=log, stderr=subprocess.STDOUT)
    if code:
        sys.exit(f"seed {seed} ended with exit code {code}; see {log.name}")
    summary: dict[str, Any] = json.loads((run / "summary.json").read_text())
    seconds = {
        "command_seconds": round(time.monotonic() - began, 1),
        "cpu_seconds": round(_cpu_seconds() - used, 1),
    }
    return summary | seconds


def _cpu_seconds() -> float:
    """Of all processes that this one has waited for."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def tested(checkpoint: Path, seed: int) -> float:
    """The mean return of 100 greedy episodes that nothing was chosen by."""
    policy = load_policy(checkpoint)
    result = run_greedily(policy.env, policy.agent.act_greedily, TEST_SEED + seed, EPISODES)
    assert result is not None
    return round(result.mean_return, 2)


def table(rows: list[dict[str, Any]]) -> str:
    """Rows as a Markdown table; lists are left out."""
    names = [name for name, value in rows[0].items() if not isinstance(value, list)]
    lines = [names, ["---"] * len(names)]
    lines += [[str(row[name]) for name in names] for row in rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)
