"""Comparison tables as Markdown: every run, and statistics of each group of seeds."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from rl_workbench.statistics import Statistics, describe
from rl_workbench.tools.benchmark.results import RunResult

# The columns of each command: name, and the field of RunResult. What depends on the clock is a table of
# its own, so that a benchmark's results are the same bytes whatever happened on the way.
COMPARE = {name: name for name in ("group", "run", "seed", "score", "success", "training_mean",
                                   "episodes", "steps", "seconds", "solved_step", "fault")}  # fmt: skip
_RUN = {"variant": "group", "seed": "seed"}
RESULTS = {**_RUN, "best": "score"} | {name: name for name in (
    "success", "final", "evaluations", "avg20", "solved_step", "steps", "episodes", "fault")}  # fmt: skip
COSTS = _RUN | {name: name for name in ("solved_seconds", "seconds", "cpu_seconds")}

SUCCESS = "success"  # a column, between 0 and 1; left out where no environment says it


def grouped(results: Sequence[RunResult]) -> dict[str, list[RunResult]]:
    """Groups in the order in which they appear."""
    names = dict.fromkeys(each.group for each in results)
    return {name: [each for each in results if each.group == name] for name in names}


def statistics_of(results: Sequence[RunResult], field: str = "score") -> Statistics | None:
    """Of a figure of a group; None if no run has it."""
    values = [value for each in results if (value := getattr(each, field)) is not None]
    return describe(np.array(values)) if values else None


def rows(results: Sequence[RunResult], columns: Mapping[str, str]) -> list[dict[str, Any]]:
    """A command's columns as plain values, for JSON."""
    return [{name: getattr(each, field) for name, field in columns.items()} for each in results]


def table(results: Sequence[RunResult], columns: Mapping[str, str]) -> str:
    """Every run, as Markdown."""
    shown = {name: field for name, field in columns.items() if _is_told(results, name)}
    cells = [
        [_percent(value) if name == SUCCESS else _cell(value) for name, value in row.items()]
        for row in rows(results, shown)
    ]
    return _markdown([[name.replace("_", " ") for name in shown], *cells])


def _is_told(results: Sequence[RunResult], column: str) -> bool:
    return column != SUCCESS or any(each.success is not None for each in results)


def _percent(value: float | None) -> str:
    return "-" if value is None else f"{value:.0%}"


def _cell(value: Any) -> str:
    if value is None:
        return "-"
    return f"{value:.1f}" if isinstance(value, float) else str(value).replace("|", "/")


def _markdown(lines: list[list[str]]) -> str:
    head, *rest = lines
    return "\n".join(f"| {' | '.join(line)} |" for line in [head, ["---"] * len(head), *rest])


# A cell of a summary: of the results of a group, and the return from which it counts as solved.
Cell = Callable[[Sequence[RunResult], float | None], str]


def summary_table(
    groups: Mapping[str, Sequence[RunResult]],
    columns: Sequence[tuple[str, Cell]],
    thresholds: Mapping[str, float | None] | None = None,
) -> str:
    """A line for each group, as Markdown. Where seeds lack a figure, it says over how many it is.

    Args:
        thresholds: the groups' returns from which they count as solved, where that is counted.
    """
    every = [each for results in groups.values() for each in results]
    shown = [(name, cell) for name, cell in columns if _is_told(every, name)]
    lines = [
        [cell(results, (thresholds or {}).get(name)) for _, cell in shown]
        for name, results in groups.items()
    ]
    return _markdown([[name for name, _ in shown], *lines])


def _name(results: Sequence[RunResult], line: float | None) -> str:
    return results[0].group


def _scored(results: Sequence[RunResult], line: float | None) -> str:
    count = sum(each.score is not None for each in results)
    return str(count) if count == len(results) else f"{count} of {len(results)} (see faults)"


def _solved_count(results: Sequence[RunResult], line: float | None) -> str:
    """A seed without a figure hasn't solved it."""
    scores = [each.score for each in results if each.score is not None]
    failed = sum(bool(each.fault) for each in results)
    reached = sum(score >= line for score in scores) if line is not None else 0
    text = "-" if line is None and scores else f"{reached} of {len(results)}"
    return f"{text}, {failed} failed" if failed else text


def _of(field: str, show: Callable[[Statistics], str]) -> Cell:
    """A statistic of a figure."""

    def cell(results: Sequence[RunResult], line: float | None) -> str:
        found = statistics_of(results, field)
        if found is None:
            return "-"
        lacking = f" ({found.n} of {len(results)})" if found.n < len(results) else ""
        return show(found) + lacking

    return cell


def _spread(found: Statistics) -> str:
    return f"{found.mean:.1f}" + (f" ± {found.std:.1f}" if found.n > 1 else "")


def _median(found: Statistics) -> str:
    return f"{found.median:.1f}"


def _iqm(found: Statistics) -> str:
    interval = found.iqm_interval
    return f"{found.iqm:.1f}" + (f" [{interval[0]:.1f}, {interval[1]:.1f}]" if interval else "")


def _range(interval: tuple[float, float] | None) -> str:
    return "needs two seeds" if interval is None else f"{interval[0]:.1f} to {interval[1]:.1f}"


def _steps_to_solve(reduce: Callable[[list[float]], Any]) -> Cell:
    """Over all seeds: one that never solved it took for ever."""

    def cell(results: Sequence[RunResult], line: float | None) -> str:
        steps = [math.inf if each.solved_step is None else each.solved_step for each in results]
        found = reduce(steps)
        never = "-" if line is None else "never"
        return never if found == math.inf else f"{found:.0f}"

    return cell


def _most_seconds(results: Sequence[RunResult], line: float | None) -> str:
    return _cell(max((each.seconds for each in results if each.seconds is not None), default=None))


COMPARE_SUMMARY = (
    ("group", _name),
    ("runs", _scored),
    ("mean ± std", _of("score", _spread)),
    (SUCCESS, _of("success", lambda found: _percent(found.mean))),
    ("median", _of("score", _median)),
    ("IQM", _of("score", lambda found: f"{found.iqm:.1f}")),
    ("95% of the mean", _of("score", lambda found: _range(found.mean_interval))),
    ("95% of the IQM", _of("score", lambda found: _range(found.iqm_interval))),
)
RESULTS_SUMMARY = (
    ("variant", _name),
    ("seeds solved", _solved_count),
    ("best: mean ± std", _of("score", _spread)),
    (SUCCESS, _of("success", lambda found: _percent(found.mean))),
    ("IQM [95 %]", _of("score", _iqm)),
    ("final: IQM [95 %]", _of("final", _iqm)),
    ("evaluations: IQM [95 %]", _of("evaluations", _iqm)),
    ("median steps to solve", _steps_to_solve(np.median)),
    ("most", _steps_to_solve(max)),
)
COSTS_SUMMARY = (
    ("variant", _name),
    ("median seconds", _of("seconds", _median)),
    ("most", _most_seconds),
)
