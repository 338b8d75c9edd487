#!/usr/bin/env python3
"""How often the tutorial's own DQN, with its defaults, reaches 475 in its 500 episodes.

    ./ws python3 benchmark/dqn_tutorial.py [--seeds 10] [--out DIR]

Prints a table with every seed and writes dqn_tutorial.json. All means are of returns:
- avg20_475: the first episode at which the tutorial's own column Avg(20) is 475 or more
- avg20_max, avg100_max: the largest mean of 20 and of 100 episodes in a row, exploration included
- final_greedy, best_greedy: 100 greedy episodes of the last and of the best checkpoint
"""

from typing import Any

import dqn_runs
import numpy as np
import reporting


def row(seed: int, summary: dict[str, Any], final: float, best: float) -> dict[str, Any]:
    returns = summary["returns"]
    twenty = means(returns, 20)
    reached = np.flatnonzero(twenty >= dqn_runs.SOLVED)
    return {
        "seed": seed,
        "episodes": summary["episodes"],
        "steps": summary["steps"],
        "avg20_475": int(reached[0]) + 20 if reached.size else None,
        "avg20_max": round(float(twenty.max()), 1),
        "avg100_max": round(float(means(returns, 100).max()), 1),
        "final_greedy": final,
        "best_greedy": best,
        "seconds": round(summary["seconds"], 1),
        "returns": returns,
    }


def means(values: list[float], window: int) -> np.ndarray:
    """Of each `window` values in a row."""
    return np.convolve(values, np.full(window, 1 / window), mode="valid")


def main() -> None:
    chosen = reporting.options(__doc__ or "", seeds=10)
    folder = chosen.out / "dqn_tutorial"
    folder.mkdir(parents=True)
    rows = []
    for seed in range(chosen.seeds):
        summary = dqn_runs.train(folder, seed, "--preset=tutorial")
        run = folder / f"seed_{seed}"
        final, best = (dqn_runs.tested(run / name, seed) for name in ("last.pt", "best.pt"))
        rows.append(row(seed, summary, final, best))
        print(dqn_runs.table(rows[-1:]).splitlines()[-1], flush=True)
    print(dqn_runs.table(rows))
    for name in ("avg20_max", "avg100_max", "final_greedy", "best_greedy"):
        count = sum(each[name] >= dqn_runs.SOLVED for each in rows)
        print(f"{name} >= {dqn_runs.SOLVED:g}: {count} of {len(rows)} seeds")
    reporting.write(chosen.out, "dqn_tutorial", rows)


if __name__ == "__main__":
    main()
