"""`benchmark`: every variant over several seeds, each run's figures, and what they come to."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from typing import Any

import numpy as np

from rl_workbench.errors import WorkbenchError
from rl_workbench.tools.benchmark.comparison import greedy, tried
from rl_workbench.tools.benchmark.statistics import describe
from rl_workbench.tools.benchmark.trainings import Job
from rl_workbench.tools.runs.runs import (
    CONFIRMED,
    EVALUATION,
    Curve,
    Run,
    evaluation_curve,
    open_run,
    threshold,
)

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
    solved_seconds: float | None  # since the training began, evaluations included, pauses not
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
    except WorkbenchError as error:
        return _nothing(job, str(error))
    faults: list[str] = []
    summary = job.summary()
    if not summary.get("complete"):
        faults.append(str(summary.get("failure") or "not complete"))
    step, seconds = tried(lambda: _solved(run, job), faults) or (None, None)
    returns = summary.get("returns") or []
    return Row(
        job.variant.name,
        job.seed,
        tried(lambda: greedy(run, episodes, "best", say), faults),
        tried(lambda: greedy(run, episodes, "last", say), faults),
        tried(lambda: _mean_evaluation(run), faults),
        float(_means(returns).max()) if len(returns) >= AVERAGE else None,
        step,
        seconds,
        summary.get("steps"),
        summary.get("episodes"),
        summary.get("seconds"),
        job.cost().get("cpu_seconds"),
        "; ".join(dict.fromkeys(faults)),
    )


def _nothing(job: Job, fault: str) -> Row:
    empty = {each.name: None for each in fields(Row)}
    return Row(**{**empty, "variant": job.variant.name, "seed": job.seed, "fault": fault})  # type: ignore[arg-type]


def _means(returns: list[float]) -> np.ndarray:
    return np.convolve(returns, np.full(AVERAGE, 1 / AVERAGE), mode="valid")


def _mean_evaluation(run: Run) -> float | None:
    values = evaluation_curve(run).values
    return float(values.mean()) if len(values) else None


def _solved(run: Run, job: Job) -> tuple[int, float | None] | None:
    """Step and seconds of the first evaluation at the line; a confirmed one, where there are such."""
    line = threshold(run.env_id)
    if line is None:
        return None
    curve = evaluation_curve(run, CONFIRMED)
    if not len(curve.values):
        curve = evaluation_curve(run, EVALUATION)
    above = np.flatnonzero(curve.values >= line)
    return (int(curve.steps[above[0]]), _seconds(run, job, curve, above[0])) if len(above) else None


def _seconds(run: Run, job: Job, curve: Curve, index: int) -> float | None:
    """How long it had trained until a point of a curve, without the pauses of its benchmark."""
    until, began = float(curve.times[index]), run.config.get("began")
    spans = job.cost().get("spans", [])
    pauses = [
        following - ended
        for (_, ended), (following, _) in zip(spans[:-1], spans[1:], strict=True)
        if following <= until
    ]
    return None if began is None else round(until - began - sum(pauses), 1)


def table(rows: Sequence[Row], with_faults: bool = True) -> str:
    """Every run, as Markdown."""
    names = [each.name for each in fields(Row) if with_faults or each.name != "fault"]
    lines = [[name.replace("_", " ") for name in names], ["---"] * len(names)]
    lines += [[_cell(getattr(row, name)) for name in names] for row in rows]
    return _markdown(lines)


def summary_table(rows: Sequence[Row], lines_of: Mapping[str, float | None]) -> str:
    """A line for each variant: how many seeds reach the line, and statistics over all seeds.

    Where a seed has no figure, it says over how many the statistic is.

    Args:
        lines_of: the variants' returns from which they count as solved.
    """
    head = ["variant", "seeds solved", "best: mean ± std", "IQM [95 %]", "final: IQM [95 %]",
            "evaluations: IQM [95 %]", "median steps to solve", "most", "median seconds", "most"]  # fmt: skip
    lines = [head, ["---"] * len(head)]
    for name in dict.fromkeys(row.variant for row in rows):
        own = [row for row in rows if row.variant == name]
        lines.append([name, *_summary(own, lines_of.get(name))])
    return _markdown(lines)


def _summary(rows: list[Row], line: float | None) -> list[str]:
    best = [row.best for row in rows if row.best is not None]
    steps = [math.inf if row.solved_step is None else row.solved_step for row in rows]
    never = "-" if line is None else "never"
    seconds = [row.seconds for row in rows if row.seconds is not None]
    return [
        _solved_count(rows, best, line),
        f"{np.mean(best):.1f} ± {np.std(best, ddof=1):.1f}{_of(best, rows)}" if len(best) > 1 else "-",
        *(_iqm(rows, name) for name in ("best", "final", "evaluations")),
        *((never if value == math.inf else f"{value:.0f}") for value in (np.median(steps), max(steps))),
        f"{np.median(seconds):.1f}{_of(seconds, rows)}" if seconds else "-",
        f"{max(seconds):.1f}" if seconds else "-",
    ]  # fmt: skip


def _solved_count(rows: list[Row], best: list[float], line: float | None) -> str:
    """A seed without a figure hasn't solved it."""
    failed = sum(bool(row.fault) for row in rows)
    reached = sum(each >= line for each in best) if line is not None else 0
    text = "-" if line is None and best else f"{reached} of {len(rows)}"
    return f"{text}, {failed} failed" if failed else text


def _of(present: Sequence[float], rows: Sequence[Row]) -> str:
    return "" if len(present) == len(rows) else f" ({len(present)} of {len(rows)})"


def _iqm(rows: list[Row], name: str) -> str:
    present = [value for row in rows if (value := getattr(row, name)) is not None]
    if not present:
        return "-"
    found = describe(np.array(present))
    interval = found.iqm_interval
    text = f"{found.iqm:.1f}" + (f" [{interval[0]:.1f}, {interval[1]:.1f}]" if interval else "")
    return text + _of(present, rows)


def _cell(value: Any) -> str:
    if value is None:
        return "-"
    return f"{value:.1f}" if isinstance(value, float) else str(value).replace("|", "/")


def _markdown(lines: list[list[str]]) -> str:
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def content(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """Plain values, for JSON."""
    return [asdict(row) for row in rows]
