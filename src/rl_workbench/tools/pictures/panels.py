"""Which runs share the axes of a picture, and by which names."""

from collections import Counter
from collections.abc import Callable, Sequence

import numpy as np

from rl_workbench.env_ids import threshold
from rl_workbench.errors import WorkbenchError
from rl_workbench.plotting.curves import Panel, SeedCurve
from rl_workbench.tools.runs.runs import (
    Curve,
    Run,
    evaluation_curve,
    success_curve,
    summary_of,
    training_curve,
)


def run_panels(runs: Sequence[Run], over: str) -> list[Panel]:
    """Every run by itself, a panel for each environment.

    Args:
        over: "episodes" or "steps".

    Raises:
        WorkbenchError: if a run has no episode yet.
    """
    short = {run.folder: f"{run.experiment}, seed {run.seed}" for run in runs}
    count = Counter((run.env_id, short[run.folder]) for run in runs)

    def name(run: Run) -> str:
        found = short[run.folder]
        return found if count[run.env_id, found] == 1 else f"{found} ({run.name})"

    def curve(run: Run) -> SeedCurve:
        found = training_curve(run)
        episodes = np.arange(1.0, len(found.values) + 1.0)
        return SeedCurve(found.steps if over == "steps" else episodes, found.values)

    def success(run: Run) -> SeedCurve | None:
        found = success_curve(run)
        episodes = np.searchsorted(training_curve(run).steps, found.steps, side="right")
        steps = found.steps if over == "steps" else episodes.astype(float)
        return SeedCurve(steps, found.values) if len(found.values) else None

    return [*_panels(runs, name, curve), *_success_panels(runs, name, success)]


def seed_panels(runs: Sequence[Run]) -> list[Panel]:
    """The returns of experiments over their seeds, a panel for each environment.

    Raises:
        WorkbenchError: if no run has an episode.
    """

    def curve(run: Run) -> SeedCurve | None:
        try:
            return _seed_curve(run, training_curve(run))
        except WorkbenchError:
            return None  # the table names it

    def success(run: Run) -> SeedCurve | None:
        try:
            found = success_curve(run)
            return _seed_curve(run, found) if len(found.values) else None
        except WorkbenchError:
            return None

    panels = _panels(runs, lambda run: run.experiment, curve)
    if not panels:
        raise WorkbenchError("no episode has ended yet in any of these runs")
    return [*panels, *_success_panels(runs, lambda run: run.experiment, success)]


def variant_panels(runs: Sequence[Run]) -> list[Panel]:
    """The evaluations of experiments over their seeds, a panel for each experiment.

    Raises:
        WorkbenchError: if nothing was evaluated.
    """

    def curve(run: Run) -> SeedCurve | None:
        found = evaluation_curve(run)
        return _seed_curve(run, found) if len(found.values) else None

    panels = _panels(runs, lambda run: run.experiment, curve, apart=True)
    if not panels:
        raise WorkbenchError("none of these runs was evaluated")
    return panels


def _seed_curve(run: Run, curve: Curve) -> SeedCurve:
    return SeedCurve(curve.steps, curve.values, bool(summary_of(run).get("complete")))


def _success_panels(
    runs: Sequence[Run],
    name_of: Callable[[Run], str],
    curve_of: Callable[[Run], SeedCurve | None],
) -> list[Panel]:
    """Those of the environments that say whether an episode is a success."""
    return [
        panel._replace(threshold=None, shows_success=True)
        for panel in _panels(runs, name_of, curve_of)
    ]


def _panels(
    runs: Sequence[Run],
    name_of: Callable[[Run], str],
    curve_of: Callable[[Run], SeedCurve | None],
    apart: bool = False,
) -> list[Panel]:
    """A panel for each environment, in the order in which they appear, of runs that have a curve.

    Args:
        apart: also one for each name.
    """
    found: dict[tuple[str, str], dict[str, list[SeedCurve]]] = {}
    for run in runs:
        name, curve = name_of(run), curve_of(run)
        if curve is not None:
            panel = found.setdefault((run.env_id, name if apart else ""), {})
            panel.setdefault(name, []).append(curve)
    return [Panel(env_id, groups, threshold(env_id)) for (env_id, _), groups in found.items()]
