"""`plot`: training curves of runs as PNG. Other commands use its panels."""

import argparse
from collections import Counter
from collections.abc import Callable, Sequence
from functools import partial
from operator import attrgetter
from pathlib import Path
from typing import TYPE_CHECKING

from rl_workbench.errors import WorkbenchError
from rl_workbench.starting import Interrupt
from rl_workbench.tools.flags import write_figure
from rl_workbench.tools.runs import Run, curve_of, find_runs, summary_of, training_curve
from rl_workbench.training.progress import tell, warn
from rl_workbench.training.scalar_log import EVALUATION, RETURN, SUCCESS

if TYPE_CHECKING:
    from rl_workbench.plotting import Panel, SeedCurve

_experiment = attrgetter("experiment")  # of a run
CurveOf = Callable[[Run], "SeedCurve | None"]  # None: leave the run out


def add_flags(parser: argparse.ArgumentParser) -> None:
    """Adds the flags of the command."""
    parser.add_argument("runs", nargs="+", metavar="RUN", help="run folders, or patterns")
    parser.add_argument("--over", choices=("episodes", "steps"), default="episodes",
                        help="the horizontal axis (default episodes)")  # fmt: skip
    parser.add_argument("--out", type=Path, required=True, metavar="FILE.png", help="the picture")


def run(arguments: argparse.Namespace, interrupt: Interrupt) -> None:
    """Draws the curves."""
    from rl_workbench.plotting import STEPS, training_curves

    panels = run_panels(find_runs(arguments.runs, warn), arguments.over)
    across = "episode" if arguments.over == "episodes" else STEPS
    write_figure(arguments.out, training_curves(panels, across))
    tell(str(arguments.out))


def run_panels(runs: Sequence[Run], over: str) -> "list[Panel]":
    """Makes panels of single runs, one for each environment."""
    import numpy as np

    from rl_workbench.plotting import SeedCurve

    short = {run.folder: f"{run.experiment}, seed {run.seed}" for run in runs}
    count = Counter((run.env_id, short[run.folder]) for run in runs)

    def name(run: Run) -> str:
        label = short[run.folder]
        return label if count[run.env_id, label] == 1 else f"{label} ({run.name})"

    def curve(run: Run) -> "SeedCurve":
        rewards = training_curve(run)
        episodes = np.arange(1.0, len(rewards.values) + 1.0)
        return SeedCurve(rewards.steps if over == "steps" else episodes, rewards.values)

    def success(run: Run) -> "SeedCurve | None":
        rates = curve_of(run.folder, SUCCESS)
        episodes = np.searchsorted(training_curve(run).steps, rates.steps, side="right")
        steps = rates.steps if over == "steps" else episodes.astype(float)
        return SeedCurve(steps, rates.values) if len(rates.values) else None

    return [*_panels(runs, name, curve), *_success_panels(runs, name, success)]


def seed_panels(runs: Sequence[Run]) -> "list[Panel]":
    """Makes panels of the training returns of experiments over their seeds, one for each environment."""
    panels = _panels(runs, _experiment, partial(_seed_curve, tag=RETURN))
    if not panels:
        raise WorkbenchError("no episode has ended yet in any of these runs")
    return [*panels, *_success_panels(runs, _experiment, partial(_seed_curve, tag=SUCCESS))]


def variant_panels(runs: Sequence[Run]) -> "list[Panel]":
    """Makes panels of the evaluations of experiments over their seeds, one for each experiment."""
    panels = _panels(runs, _experiment, partial(_seed_curve, tag=EVALUATION), apart=True)
    if not panels:
        raise WorkbenchError("none of these runs was evaluated")
    return panels


def _seed_curve(run: Run, tag: str) -> "SeedCurve | None":
    """Returns None if there is nothing that can be read: the table of results says why."""
    from rl_workbench.plotting import SeedCurve

    try:
        curve, is_complete = curve_of(run.folder, tag), bool(summary_of(run).get("complete"))
    except WorkbenchError:
        return None
    return SeedCurve(curve.steps, curve.values, is_complete) if len(curve.values) else None


def _success_panels(runs: Sequence[Run], name_of: Callable[[Run], str], curve_of: CurveOf) -> "list[Panel]":
    return [panel._replace(threshold=None, shows_success=True) for panel in _panels(runs, name_of, curve_of)]


def _panels(
    runs: Sequence[Run], name_of: Callable[[Run], str], curve_of: CurveOf, apart: bool = False
) -> "list[Panel]":
    """Makes a panel for each environment, in order of appearance; with `apart`, also for each name."""
    from rl_workbench.env_ids import threshold
    from rl_workbench.plotting import Panel

    panels: dict[tuple[str, str], dict[str, list[SeedCurve]]] = {}
    for run in runs:
        name, curve = name_of(run), curve_of(run)
        if curve is not None:
            panel = panels.setdefault((run.env_id, name if apart else ""), {})
            panel.setdefault(name, []).append(curve)
    return [Panel(env_id, groups, threshold(env_id)) for (env_id, _), groups in panels.items()]
