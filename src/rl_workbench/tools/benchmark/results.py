"""The figures of one run among others: what its policies are worth, what its training took."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from rl_workbench.env_ids import threshold
from rl_workbench.errors import WorkbenchError
from rl_workbench.plotting.curves import WINDOW
from rl_workbench.tools.runs.episodes import play
from rl_workbench.tools.runs.policies import load_learned
from rl_workbench.tools.runs.runs import (
    Run,
    cost_of,
    evaluation_curve,
    summary_of,
    training_curve,
)
from rl_workbench.training.evaluator import Evaluation
from rl_workbench.training.history import LAST
from rl_workbench.training.scalar_log import CONFIRMED, EVALUATION


@dataclass(frozen=True)
class RunResult:
    """The figures of one run. What it doesn't have is None, and `fault` says why."""

    group: str  # whose seeds are compared with those of others
    seed: int
    run: str  # the folder's name
    score: float | None = None  # by which groups are compared: mean return of greedy episodes
    success: float | None = None  # their success rate, 0 to 1, if the environment says
    final: float | None = None  # mean return of the last checkpoint's greedy episodes
    training_mean: float | None = None  # return of the last training episodes
    evaluations: float | None = None  # mean of all evaluations during the training
    avg20: float | None = None  # largest mean return of 20 training episodes in a row
    solved_step: int | None = None  # of the first evaluation at or above the threshold
    solved_seconds: float | None = None  # since it began, evaluations included, pauses not
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
    """The figures of one run; what can't be read is a fault in its row, not an error.

    Args:
        episodes: greedy ones, that nothing was chosen by, for each score; 0: the score is the mean
            of the last training episodes.
        warn: is told of checkpoints that are passed over.
        which: of its checkpoints, "best" or "last".
        also_last: plays the last one, too.
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
        faults.append(str(summary.get("failure") or "not complete"))
    returns, steps = np.array(summary.get("returns") or []), summary.get("steps")
    if "returns" not in summary and (curve := attempt(lambda: training_curve(run))):
        returns, steps = curve.values, int(curve.steps[-1])
    trained = float(returns[-LAST:].mean()) if len(returns) else None
    success = summary.get(f"success_rate_last_{LAST}")
    score, final = trained, None
    if episodes:
        played = attempt(lambda: _greedy(run, episodes, which, warn))
        score = success = None
        if played is not None:
            score, success = played.mean_return, played.success_rate
    if also_last and (last := attempt(lambda: _greedy(run, episodes, "last", warn))):
        final = last.mean_return
    step, seconds = attempt(lambda: _solved(run)) or (None, None)
    return RunResult(
        group,
        run.seed,
        run.name,
        score,
        success,
        final,
        trained,
        attempt(lambda: _mean_evaluation(run)),
        _largest_mean(returns),
        step,
        seconds,
        steps,
        summary.get("episodes") or len(returns) or None,
        summary.get("seconds"),
        cost_of(run.folder).get("cpu_seconds"),
        "; ".join(dict.fromkeys(faults)),
    )


def _greedy(run: Run, episodes: int, which: str, warn: Callable[[str], None]) -> Evaluation:
    """A checkpoint's greedy episodes."""
    policy = load_learned(run, which, say=warn)
    try:
        return play(policy, episodes, run.seed)
    finally:
        policy.env.close()


def _mean_evaluation(run: Run) -> float | None:
    values = evaluation_curve(run).values
    return float(values.mean()) if len(values) else None


def _largest_mean(returns: np.ndarray) -> float | None:
    if len(returns) < WINDOW:
        return None
    return float(np.convolve(returns, np.full(WINDOW, 1 / WINDOW), mode="valid").max())


def _solved(run: Run) -> tuple[int, float | None] | None:
    """Step and seconds of the first evaluation at the threshold; a confirmed one, if there are."""
    line = threshold(run.env_id)
    curve = evaluation_curve(run, CONFIRMED)
    if not len(curve.values):
        curve = evaluation_curve(run, EVALUATION)
    above = np.flatnonzero(curve.values >= (math.inf if line is None else line))
    if not len(above):
        return None
    return int(curve.steps[above[0]]), _seconds_until(run, float(curve.times[above[0]]))


def _seconds_until(run: Run, until: float) -> float | None:
    """How long it had trained until a time of the clock, without the pauses of its benchmark."""
    began, spans = run.config.get("began"), cost_of(run.folder).get("spans", [])
    if began is None:
        return None
    pauses = [
        following - ended
        for (_, ended), (following, _) in zip(spans[:-1], spans[1:], strict=True)
        if began <= ended and following <= until  # before that nothing was kept
    ]
    return round(until - began - sum(pauses), 1)
