"""`benchmark`: every variant over several seeds, each run's figures, and what they come to."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, fields
from typing import Any

import numpy as np

from cartpole.errors import CartpoleError
from cartpole.workbench.episodes import play
from cartpole.workbench.players import load_player
from cartpole.workbench.runs import (
    CONFIRMED,
    EVALUATION,
    Run,
    evaluation_curve,
    open_run,
    threshold,
)
from cartpole.workbench.statistics import describe
from cartpole.workbench.trainings import Job

AVERAGE = 20  # [episodes], the document's Avg(20)


@dataclass(frozen=True)
class Row:
    """One run. What it doesn't have is None, and `fault` says why."""

    variant: str
    seed: int
    best: float | None  # mean return of unseen greedy episodes, best checkpoint
    final: float | None  # last checkpoint
    evaluations: float | None  # mean of all evaluations during the training
    avg20: float | None  # largest mean return of 20 training episodes in a row
    solved_step: int | None  # of the first evaluation at or above the line
    solved_seconds: float | None  # of wall time since the training began, evaluations included
    steps: int | None
    episodes: int | None
    seconds: float | None
    cpu_seconds: float | None
    fault: str


def examine(job: Job, episodes: int, say: Callable[[str], None]) -> Row:
    """The figures of one run; what can't be read is a fault in its row, not an error.

    Args:
        episodes: greedy ones, that nothing was chosen by, for each of the two checkpoints.
    """
    try:
        run = open_run(job.folder)
    except CartpoleError as error:
        return _nothing(job, str(error))
    faults: list[str] = []
    summary = job.summary()
    if not summary.get("complete"):
        faults.append(str(summary.get("failure") or "not complete"))
    step, seconds = _solved(run)
    returns = summary.get("returns") or []
    return Row(
        job.variant.name,
        job.seed,
        _greedy(run, "best", episodes, say, faults),
        _greedy(run, "last", episodes, say, faults),
        _mean_evaluation(run),
        float(_means(returns).max()) if len(returns) >= AVERAGE else None,
        step,
        seconds,
        summary.get("steps"),
        summary.get("episodes"),
        summary.get("seconds"),
        job.cost().get("cpu_seconds"),
        "; ".join(faults),
    )


def _nothing(job: Job, fault: str) -> Row:
    empty = {each.name: None for each in fields(Row)}
    return Row(**{**empty, "variant": job.variant.name, "seed": job.seed, "fault": fault})  # type: ignore[arg-type]


def _greedy(
    run: Run, which: str, episodes: int, say: Callable[[str], None], faults: list[str]
) -> float | None:
    try:
        player = load_player(run, which, say=say)
        try:
            return play(player, episodes, run.seed).mean_return
        finally:
            player.env.close()
    except CartpoleError as error:
        faults.append(str(error))
        return None


def _means(returns: list[float]) -> np.ndarray:
    return np.convolve(returns, np.full(AVERAGE, 1 / AVERAGE), mode="valid")


def _mean_evaluation(run: Run) -> float | None:
    values = evaluation_curve(run).values
    return float(values.mean()) if len(values) else None


def _solved(run: Run) -> tuple[int | None, float | None]:
    """Step and seconds of the first evaluation at the line; a confirmed one, where there are such."""
    line = threshold(run.env_id)
    if line is None:
        return None, None
    curve = evaluation_curve(run, CONFIRMED)
    if not len(curve.values):
        curve = evaluation_curve(run, EVALUATION)
    above = np.flatnonzero(curve.values >= line)
    if not len(above):
        return None, None
    first = above[0]
    return int(curve.steps[first]), round(float(curve.times[first] - run.config["began"]), 1)


def table(rows: Sequence[Row], with_faults: bool = True) -> str:
    """Every run, as Markdown."""
    names = [each.name for each in fields(Row) if with_faults or each.name != "fault"]
    lines = [[name.replace("_", " ") for name in names], ["---"] * len(names)]
    lines += [[_cell(getattr(row, name)) for name in names] for row in rows]
    return _markdown(lines)


def summary_table(rows: Sequence[Row], line: float | None) -> str:
    """A line for each variant: how many seeds reach the line, and statistics over all seeds."""
    head = ["variant", "seeds solved", "best: mean ± std", "IQM [95 %]", "final: IQM [95 %]",
            "evaluations: IQM [95 %]", "median steps to solve", "most", "median seconds", "most"]  # fmt: skip
    lines = [head, ["---"] * len(head)]
    for name in dict.fromkeys(row.variant for row in rows):
        lines.append([name, *_summary([row for row in rows if row.variant == name], line)])
    return _markdown(lines)


def _summary(rows: list[Row], line: float | None) -> list[str]:
    best = [row.best for row in rows if row.best is not None]
    solved = "-" if line is None else f"{sum(each >= line for each in best)} of {len(rows)}"
    spread = f"{np.mean(best):.1f} ± {np.std(best, ddof=1):.1f}" if len(best) > 1 else "-"
    steps = [np.inf if row.solved_step is None else row.solved_step for row in rows]
    seconds = [row.seconds for row in rows if row.seconds is not None] or [np.nan]
    return [
        solved,
        spread,
        *(_iqm([getattr(row, name) for row in rows]) for name in ("best", "final", "evaluations")),
        *(("never" if value == np.inf else f"{value:.0f}") for value in (np.median(steps), max(steps))),
        f"{np.median(seconds):.1f}",
        f"{max(seconds):.1f}",
    ]  # fmt: skip


def _iqm(values: list[float | None]) -> str:
    present = np.array([value for value in values if value is not None])
    if not len(present):
        return "-"
    found = describe(present)
    interval = found.iqm_interval
    return f"{found.iqm:.1f}" + (f" [{interval[0]:.1f}, {interval[1]:.1f}]" if interval else "")


def _cell(value: Any) -> str:
    if value is None:
        return "-"
    return f"{value:.1f}" if isinstance(value, float) else str(value).replace("|", "/")


def _markdown(lines: list[list[str]]) -> str:
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def content(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """Plain values, for JSON."""
    return [asdict(row) for row in rows]
