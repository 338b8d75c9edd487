"""`compare`: runs by group, every seed in a table, and what can be said of the group."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rl_workbench.errors import WorkbenchError
from rl_workbench.tools.benchmark.statistics import Statistics, describe
from rl_workbench.tools.runs.episodes import play
from rl_workbench.tools.runs.players import load_player
from rl_workbench.tools.runs.runs import (
    Run,
    evaluation_curve,
    summary_of,
    threshold,
    training_curve,
)

LAST = 100  # [episodes] of a training that count for its own mean


@dataclass(frozen=True)
class Row:
    """One run; figures that it doesn't have are None, and `fault` says why."""

    group: str
    seed: int
    run: str
    score: float | None  # by which groups are compared
    training_mean: float | None  # of the last episodes
    episodes: int
    steps: int
    seconds: float | None
    solved_step: int | None  # of the first evaluation above the line
    fault: str


def group_of(run: Run) -> str:
    """Experiment and environment: the seeds of one are compared with those of another."""
    return f"{run.experiment} in {run.env_id}"


def examine(run: Run, episodes: int, which: str, say: Callable[[str], None]) -> Row:
    """The figures of one run; what can't be read is a fault in its row, not an error.

    Args:
        episodes: greedy ones for the score; 0: the mean of the last training episodes.
    """
    faults: list[str] = []
    summary = tried(lambda: summary_of(run), faults) or {}
    curve = tried(lambda: training_curve(run), faults)
    trained = None if curve is None else float(curve.values[-LAST:].mean())
    score = trained if not episodes else tried(lambda: greedy(run, episodes, which, say), faults)
    if summary.get("failure"):
        faults.append(str(summary["failure"]))
    return Row(
        group_of(run),
        run.seed,
        run.name,
        score,
        trained,
        0 if curve is None else len(curve.values),
        int(summary.get("steps") or (0 if curve is None else curve.steps[-1])),
        summary.get("seconds"),
        tried(lambda: _solved_step(run), faults),
        "; ".join(dict.fromkeys(faults)),
    )


def tried(find: Callable[[], Any], faults: list[str]) -> Any:
    """What `find` gives; None, and a fault more, if it can't."""
    try:
        return find()
    except WorkbenchError as error:
        faults.append(str(error))
        return None


def greedy(run: Run, episodes: int, which: str, say: Callable[[str], None]) -> float:
    """Mean return of a checkpoint's greedy episodes.

    Raises:
        WorkbenchError: if it can't be played.
    """
    player = load_player(run, which, say=say)
    try:
        return play(player, episodes, run.seed).mean_return
    finally:
        player.env.close()


def _solved_step(run: Run) -> int | None:
    line = threshold(run.env_id)
    if line is None:
        return None
    curve = evaluation_curve(run)
    above = curve.steps[curve.values >= line]
    return int(above[0]) if len(above) else None


def by_group(rows: Sequence[Row]) -> dict[str, list[Row]]:
    """Groups and seeds in order."""
    ordered = sorted(rows, key=lambda row: (row.group, row.seed, row.run))
    return {
        name: [row for row in ordered if row.group == name]
        for name in sorted({row.group for row in ordered})
    }


def statistics_of(rows: Sequence[Row]) -> Statistics | None:
    """Of the scores of a group; None if no run has one."""
    scores = [row.score for row in rows if row.score is not None]
    return describe(np.array(scores)) if scores else None


def table(rows: Sequence[Row]) -> str:
    """Every run, as Markdown."""
    head = ["group", "run", "seed", "score", "training mean", "episodes", "steps", "seconds",
            "above the line at step", "remark"]  # fmt: skip
    lines = [head, ["---"] * len(head)]
    for row in rows:
        figures = (row.seed, row.score, row.training_mean, row.episodes, row.steps, row.seconds,
                   row.solved_step)  # fmt: skip
        lines.append([row.group, row.run, *map(_cell, figures), row.fault.replace("|", "/")])
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def summary_table(groups: dict[str, list[Row]]) -> str:
    """A line for each group, as Markdown; says how many runs have no score."""
    head = ["group", "runs", "mean ± std", "median", "IQM", "95% of the mean", "95% of the IQM"]
    lines = [head, ["---"] * len(head)]
    for name, rows in groups.items():
        found = statistics_of(rows)
        if found is None:
            lines.append([name, f"0 of {len(rows)}", *["-"] * 5])
            continue
        count = str(found.n) if found.n == len(rows) else f"{found.n} of {len(rows)} (see remarks)"
        spread = f"{found.mean:.1f} ± {found.std:.1f}" if found.n > 1 else f"{found.mean:.1f}"
        intervals = map(_range, (found.mean_interval, found.iqm_interval))
        lines.append([name, count, spread, f"{found.median:.1f}", f"{found.iqm:.1f}", *intervals])
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _cell(value: float | None) -> str:
    if value is None:
        return "-"
    return f"{value:.1f}" if isinstance(value, float) else str(value)


def _range(interval: tuple[float, float] | None) -> str:
    return "needs two seeds" if interval is None else f"{interval[0]:.1f} to {interval[1]:.1f}"
