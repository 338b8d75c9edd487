#!/usr/bin/env python3
"""How fast and how reliably dqn_train.py solves CartPole-v1; Stable-Baselines3 beside it.

    ./ws python3 benchmark/dqn_cartpole.py [--seeds 10] [--first 0] [--full 0] [--sb3 0] [--out DIR]
    ./ws extras python3 benchmark/dqn_cartpole.py --sb3 5     5 seeds of Stable-Baselines3, too

Prints a table with every seed and writes dqn_cartpole.json.
- solved_step, solved_seconds: the first evaluation that 100 greedy episodes confirmed at >= 475;
  seconds of wall time since the training began, evaluations included
- steps, seconds: of the whole training, which ends at a confirmed 495, with --full 1 at 50,000
- command_seconds: of the whole command; it also starts Python, loads torch and draws the curve
- cpu_seconds: of the processor, for the whole command
- best_greedy, final_greedy: 100 other greedy episodes of the best and of the last checkpoint

Stable-Baselines3's DQN has the options that rl-baselines3-zoo tuned for CartPole-v1, runs its
50,000 steps, and is evaluated as often; its best model is chosen by the same number of episodes.
"""

import csv
import json
from pathlib import Path
from typing import Any

import dqn_runs
import numpy as np
import reporting

STOP = 495
STEPS = 50_000


def row(seed: int, summary: dict[str, Any], run: Path) -> dict[str, Any]:
    step, seconds = solved(run)
    return {
        "algorithm": "cartpole DQN",
        "seed": seed,
        "solved_step": step,
        "solved_seconds": seconds,
        "steps": summary["steps"],
        "seconds": round(summary["seconds"], 1),
        "command_seconds": summary["command_seconds"],
        "cpu_seconds": summary["cpu_seconds"],
        "best_greedy": dqn_runs.tested(run / "best.pt", seed),
        "final_greedy": dqn_runs.tested(run / "last.pt", seed),
    }


def solved(run: Path) -> tuple[int | None, float | None]:
    """Step and seconds of the first confirmed evaluation that solves the environment."""
    began = json.loads((run / "config.json").read_text())["began"]
    with (run / "scalars.csv").open(newline="") as file:
        for each in csv.DictReader(file):
            if each["tag"] == "eval/confirmed_reward" and float(each["value"]) >= dqn_runs.SOLVED:
                return int(each["step"]), round(float(each["wall_time"]) - began, 1)
    return None, None


def told(rows: list[dict[str, Any]]) -> str:
    """What the rows come to."""
    good = [each for each in rows if each["best_greedy"] >= dqn_runs.SOLVED]
    final = sum(each["final_greedy"] >= dqn_runs.SOLVED for each in rows)
    steps = [each["solved_step"] or STEPS for each in rows]
    seconds = [each["seconds"] for each in rows]
    return (
        f"{rows[0]['algorithm']}: best >= {dqn_runs.SOLVED:g}: {len(good)} of {len(rows)} seeds, "
        f"final: {final}; steps until solved: median {np.median(steps):g}, most {max(steps)}; "
        f"seconds: median {np.median(seconds):.1f}, most {max(seconds):.1f}"
    )


def main() -> None:
    chosen = reporting.options(__doc__ or "", seeds=10, first=0, full=0, sb3=0)
    folder = chosen.out / "dqn_cartpole"
    folder.mkdir(parents=True)
    flags = [] if chosen.full else [f"--stop-at-return={STOP}"]
    groups: list[list[dict[str, Any]]] = [[], []]
    for seed in range(chosen.first, chosen.first + chosen.seeds):
        summary = dqn_runs.train(folder, seed, f"--total-timesteps={STEPS}", *flags)
        groups[0].append(row(seed, summary, folder / f"seed_{seed}"))
        print(dqn_runs.table(groups[0][-1:]).splitlines()[-1], flush=True)
    for seed in range(chosen.first, chosen.first + chosen.sb3):
        from dqn_sb3 import train  # one of the extras

        groups[1].append(train(seed, STEPS))
        print(dqn_runs.table(groups[1][-1:]).splitlines()[-1], flush=True)
    print(dqn_runs.table([each for group in groups for each in group]))
    print("\n".join(told(group) for group in groups if group))
    reporting.write(chosen.out, "dqn_cartpole", groups[0] + groups[1])


if __name__ == "__main__":
    main()
