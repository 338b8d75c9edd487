"""`plot`: training curves of one or more runs in one picture."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rl_workbench.tools.runs.runs import Run, threshold, training_curve
from rl_workbench.training.run.learning_curve import WINDOW, moving_average
from rl_workbench.training.run.results import new_figure

COLOURS = ("C0", "C1", "C2", "C4", "C5", "C6", "C8", "C9")  # without red, the threshold's, and grey
RAW_AT_MOST = 8  # runs; of more of them the single episodes would be a fog


def training_curves(runs: Sequence[Run], over: str) -> Figure:
    """The return of each episode, its moving average, and the line from which it is solved.

    Args:
        over: "episodes" or "steps", the horizontal axis.

    Raises:
        WorkbenchError: if a run has no episode yet.
    """
    figure = new_figure(10, 5)
    axes = figure.subplots()
    for index, (run, name) in enumerate(zip(runs, _names(runs), strict=True)):
        _draw(axes, run, name, COLOURS[index % len(COLOURS)], over, len(runs))
    _draw_thresholds(axes, runs)
    axes.set_title(_title(runs))
    axes.set_xlabel("episode" if over == "episodes" else "step of the environment")
    axes.set_ylabel("return")
    axes.grid(alpha=0.3)
    axes.legend(fontsize="small")
    return figure


def _title(runs: Sequence[Run]) -> str:
    if len(runs) == 1:
        return f"training: {runs[0].label}"
    environments = sorted({run.env_id for run in runs})
    return f"training in {', '.join(environments)}: mean of {WINDOW} episodes"


def _names(runs: Sequence[Run]) -> list[str]:
    """As short as tells the runs apart."""
    short = [f"{run.experiment}, seed {run.seed}" for run in runs]
    longer = [run.label for run in runs]
    for names in (short, longer):
        if len(set(names)) == len(runs):
            return names
    return [f"{label} ({run.name})" for label, run in zip(longer, runs, strict=True)]


def _draw(axes: Axes, run: Run, name: str, colour: str, over: str, count: int) -> None:
    curve = training_curve(run)
    where = curve.steps if over == "steps" else np.arange(1, len(curve.values) + 1)
    if count <= RAW_AT_MOST:
        raw = "one episode" if count == 1 else None
        axes.plot(where, curve.values, alpha=0.3, color=colour, linewidth=0.9, label=raw)
    label = f"mean of {WINDOW} episodes" if count == 1 else name
    axes.plot(where, moving_average(curve.values.tolist()), color=colour, linewidth=2, label=label)


def _draw_thresholds(axes: Axes, runs: Sequence[Run]) -> None:
    lines = {threshold(run.env_id) for run in runs}
    for line in sorted(each for each in lines if each is not None):
        axes.axhline(line, color="tab:red", linestyle="--", label=f"solved ({line:g})")
