"""Results of runs, and Markdown tables of them: one row per run, and statistics of each group of seeds."""

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from typing import Any

import numpy as np

from rl_workbench.env_ids import threshold
from rl_workbench.errors import WorkbenchError
from rl_workbench.plotting import WINDOW
from rl_workbench.statistics import Statistics, describe
from rl_workbench.tools.policies import load_learned, play
from rl_workbench.tools.runs import Run, cost_of, curve_of, summary_of, training_curve
from rl_workbench.training.evaluator import Evaluation
from rl_workbench.training.folder import is_held
from rl_workbench.training.history import LAST
from rl_workbench.training.scalar_log import CONFIRMED, EVALUATION


@dataclass(frozen=True)
class RunResult:
    """The results of one run. Missing ones are None, and `fault` says why."""

    group: str  # the group of seeds, to be compared with others
    seed: int
    run: str  # the name of the folder
    score: float | None = None  # mean return of greedy episodes, by which groups are compared
    success: float | None = None  # their success rate, 0 to 1, if the environment reports it
    final: float | None = None  # mean return of the last checkpoint's greedy episodes
    training_mean: float | None = None  # mean return of the last training episodes
    evaluations: float | None = None  # mean of all evaluations during the training
    avg20: float | None = None  # largest mean return of 20 consecutive training episodes
    solved_step: int | None = None  # of the first (confirmed) evaluation at the threshold
    steps: int | None = None
    episodes: int | None = None
    seconds: float | None = None
    cpu_seconds: float | None = None
    fault: str = ""


def examine(
    run: Run,
    group: str,
    episodes: int,
    warn: Callable[[str], None],
    which: str = "best",
    also_last: bool = False,
) -> RunResult:
    """Collects the results of a run; unreadable ones become the row's `fault`, not an error.

    The score is of that many greedy episodes of the checkpoint `which`, "best" or "last"; with 0 the mean of
    the last training episodes. `warn` receives a line for each skipped checkpoint.
    """
    faults: list[str] = []

    def attempt(find: Callable[[], Any]) -> Any:
        try:
            return find()
        except WorkbenchError as error:
            faults.append(str(error))
            return None

    summary = attempt(lambda: summary_of(run)) or {}
    if not summary.get("complete"):
        state = "running" if is_held(run.folder) else "not complete"
        faults.append(str(summary.get("failure") or state))
    returns, steps = np.array(summary.get("returns") or []), summary.get("steps")
    curve = None if "returns" in summary else attempt(lambda: training_curve(run))
    if curve is not None:  # so far
        returns, steps = curve.values, int(curve.steps[-1])
    trained = float(returns[-LAST:].mean()) if len(returns) else None
    score, success = trained, summary.get(f"success_rate_last_{LAST}")
    if episodes:
        played = attempt(lambda: _greedy(run, episodes, which, warn))
        score, success = (played.mean_return, played.success_rate) if played else (None, None)
    last = attempt(lambda: _greedy(run, episodes, "last", warn)) if also_last else None
    solved_step = attempt(lambda: _solved(run))
    evaluated = attempt(lambda: curve_of(run.folder, EVALUATION).values)
    return RunResult(
        group=group, seed=run.seed, run=run.name, score=score, success=success,
        final=last.mean_return if last else None, training_mean=trained,
        evaluations=None if evaluated is None or not len(evaluated) else float(evaluated.mean()),
        avg20=float(np.convolve(returns, np.full(WINDOW, 1 / WINDOW), mode="valid").max())
        if len(returns) >= WINDOW else None,
        solved_step=solved_step, steps=steps,
        episodes=summary.get("episodes") or len(returns) or None, seconds=summary.get("seconds"),
        cpu_seconds=cost_of(run.folder).get("cpu_seconds"), fault="; ".join(dict.fromkeys(faults)),
    )  # fmt: skip


def _greedy(run: Run, episodes: int, which: str, warn: Callable[[str], None]) -> Evaluation:
    policy = load_learned(run, which, say=warn)
    with closing(policy.env):
        return play(policy, episodes, run.seed)


def _solved(run: Run) -> int | None:
    """Returns the step of the first (if possible confirmed) evaluation at the threshold, or None."""
    line = threshold(run.env_id)
    curve = curve_of(run.folder, CONFIRMED)
    if not len(curve.values):
        curve = curve_of(run.folder, EVALUATION)
    above = np.flatnonzero(curve.values >= (math.inf if line is None else line))
    return int(curve.steps[above[0]]) if len(above) else None


# The columns of each table: title and field of RunResult. A benchmark's costs depend on the clock, so they
# have their own table: its results stay bit-identical however it was interrupted.
COMPARE = {name: name for name in ("group", "run", "seed", "score", "success", "training_mean",
                                   "episodes", "steps", "seconds", "solved_step", "fault")}  # fmt: skip
_RUN = {"variant": "group", "seed": "seed"}
RESULTS = {**_RUN, "best": "score"} | {name: name for name in (
    "success", "final", "evaluations", "avg20", "solved_step", "steps", "episodes", "fault")}  # fmt: skip
COSTS = _RUN | {name: name for name in ("seconds", "cpu_seconds")}


def grouped(results: Sequence[RunResult]) -> dict[str, list[RunResult]]:
    """Returns the results by group, in the order in which groups appear."""
    names = dict.fromkeys(each.group for each in results)
    return {name: [each for each in results if each.group == name] for name in names}


def statistics_of(results: Sequence[RunResult], field: str = "score") -> Statistics | None:
    """Returns the statistics of a field; None if no run has it."""
    values = [value for each in results if (value := getattr(each, field)) is not None]
    return describe(np.array(values)) if values else None


def rows(results: Sequence[RunResult], columns: Mapping[str, str]) -> list[dict[str, Any]]:
    """Returns a table as plain values, for JSON."""
    return [{name: getattr(each, field) for name, field in columns.items()} for each in results]


def figures(results: Sequence[RunResult]) -> dict[str, Any]:
    """Returns a group's statistics and runs as plain values, for JSON."""
    summary = statistics_of(results)
    return {"statistics": summary and summary._asdict(), "runs": rows(results, COMPARE)}


def table(results: Sequence[RunResult], columns: Mapping[str, str]) -> str:
    """Returns a Markdown table with a row for each run, without columns that no run has a value for."""
    shown = {name: field for name, field in columns.items() if _has(results, field)}
    lines = [[_cell(value, name) for name, value in row.items()] for row in rows(results, shown)]
    return _markdown([[name.replace("_", " ") for name in shown], *lines])


Cell = Callable[[Sequence[RunResult]], str]  # formats a group's results
Column = tuple[str, str, Cell]  # title, the field that it needs, its cells


def summary_table(groups: Mapping[str, Sequence[RunResult]], columns: Sequence[Column]) -> str:
    """Returns a Markdown table with a row for each group, without columns that no run has a value for."""
    every = [each for results in groups.values() for each in results]
    shown = [(title, cell) for title, field, cell in columns if _has(every, field)]
    lines = [[cell(results) for _, cell in shown] for results in groups.values()]
    return _markdown([[title for title, _ in shown], *lines])


def _has(results: Sequence[RunResult], field: str) -> bool:
    return any(getattr(each, field) is not None for each in results)


def _markdown(lines: list[list[str]]) -> str:
    head, *rest = lines
    return "\n".join(f"| {' | '.join(line)} |" for line in [head, ["---"] * len(head), *rest])


def _cell(value: Any, name: str = "") -> str:
    if value is None:
        return "-"
    if isinstance(value, float):
        return f"{value:.0%}" if name == "success" else f"{value:.1f}"
    return str(value).replace("|", "/")


def _of(title: str, field: str, show: Callable[[Statistics], str]) -> Column:
    """Makes a column of a field's statistic; its cells name the number of seeds if some lack the field."""

    def cell(results: Sequence[RunResult]) -> str:
        stats = statistics_of(results, field)
        if stats is None:
            return "-"
        return show(stats) + (f" ({stats.n} of {len(results)})" if stats.n < len(results) else "")

    return title, field, cell


def _solved_count(results: Sequence[RunResult]) -> str:
    failed = sum(bool(each.fault) for each in results)
    solved = sum(each.solved_step is not None for each in results)
    return f"{solved} of {len(results)}" + (f", {failed} failed" if failed else "")


def _steps_to_solve(title: str, reduce: Callable[[list[float]], Any]) -> Column:
    """Makes a column of the steps to solve; a seed that never solved it counts as infinite."""

    def cell(results: Sequence[RunResult]) -> str:
        step = reduce([each.solved_step or math.inf for each in results])
        return "never" if step == math.inf else f"{step:.0f}"

    return title, "group", cell


def _iqm(found: Statistics) -> str:
    interval = found.iqm_interval
    return f"{found.iqm:.1f}" + (f" [{interval[0]:.1f}, {interval[1]:.1f}]" if interval else "")


_NAME: Column = ("variant", "group", lambda results: results[0].group)
SUMMARY = (
    _NAME,
    ("seeds solved", "group", _solved_count),
    _of("best: mean ± std", "score", lambda each: f"{each.mean:.1f}" + f" ± {each.std:.1f}" * (each.n > 1)),
    _of("success", "success", lambda each: f"{each.mean:.0%}"),
    _of("median", "score", lambda each: f"{each.median:.1f}"),
    _of("IQM [95 %]", "score", _iqm),
    _of("final: IQM [95 %]", "final", _iqm),
    _of("evaluations: IQM [95 %]", "evaluations", _iqm),
    _steps_to_solve("median steps to solve", np.median),
    _steps_to_solve("most", max),
)  # fmt: skip
