"""`plot`: training curves of one or more runs in one picture."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from cartpole.training.plots import WINDOW, moving_average
from cartpole.workbench.files import new_figure
from cartpole.workbench.runs import Run, threshold, training_curve

RAW_AT_MOST = 8  # runs; of more of them the single episodes would be a fog


def training_curves(runs: Sequence[Run], over: str) -> Figure:
    """The return of each episode, its moving average, and the line from which it is solved.

    Args:
        over: "episodes" or "steps", the horizontal axis.

    Raises:
        CartpoleError: if a run has no episode yet.
    """
    figure = new_figure(10, 5)
    axes = figure.subplots()
    for index, run in enumerate(runs):
        _draw(axes, run, f"C{index % 10}", over, len(runs))
    _draw_thresholds(axes, runs)
    environments = sorted({run.env_id for run in runs})
    axes.set_title(f"training in {', '.join(environments)}")
    axes.set_xlabel("episode" if over == "episodes" else "step of the environment")
    axes.set_ylabel("return")
    axes.grid(alpha=0.3)
    axes.legend(fontsize="small")
    return figure


def _draw(axes: Axes, run: Run, colour: str, over: str, count: int) -> None:
    curve = training_curve(run)
    where = curve.steps if over == "steps" else np.arange(1, len(curve.values) + 1)
    if count <= RAW_AT_MOST:
        raw = "one episode" if count == 1 else None
        axes.plot(where, curve.values, alpha=0.3, color=colour, linewidth=0.9, label=raw)
    label = f"mean of {WINDOW} episodes" if count == 1 else f"{run.experiment}, seed {run.seed}"
    axes.plot(where, moving_average(curve.values.tolist()), color=colour, linewidth=2, label=label)


def _draw_thresholds(axes: Axes, runs: Sequence[Run]) -> None:
    lines = {threshold(run.env_id) for run in runs}
    for line in sorted(each for each in lines if each is not None):
        axes.axhline(line, color="tab:red", linestyle="--", label=f"solved ({line:g})")
