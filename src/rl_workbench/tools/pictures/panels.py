"""Evaluations during the training, a panel for each variant, with the first one in grey behind it."""

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rl_workbench.errors import WorkbenchError
from rl_workbench.tools.pictures.curves import draw_band
from rl_workbench.tools.runs.runs import Run, evaluation_curve, threshold
from rl_workbench.training.run.results import new_figure

COLUMNS = 4
SIZE = (3.2, 2.4)  # [inches] of a panel


def evaluation_panels(runs: Sequence[Run]) -> Figure:
    """Mean return of greedy evaluations over the training's steps: means over seeds, 95 % bands.

    Raises:
        WorkbenchError: if nothing was evaluated.
    """
    variants = {
        name: curves
        for name in dict.fromkeys(run.experiment for run in runs)
        if (curves := _curves([run for run in runs if run.experiment == name]))
    }
    if not variants:
        raise WorkbenchError("none of these runs was evaluated")
    columns = min(COLUMNS, len(variants))
    rows = math.ceil(len(variants) / columns)
    figure = new_figure(max(SIZE[0] * columns, 6.0), SIZE[1] * rows + 0.6)
    grid = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    first, behind = next(iter(variants.items()))
    lines = {run.experiment: threshold(run.env_id) for run in runs}
    for axes, (name, curves) in zip(grid.flat, variants.items(), strict=False):
        if name != first:
            draw_band(axes, behind, "tab:gray", first)
        draw_band(axes, curves, "tab:blue", name)
        _finish(axes, f"{name} ({len(curves)} seeds)", lines[name])
    for axes in grid.flat[len(variants) :]:
        axes.set_axis_off()
    figure.supxlabel("step of the environment", fontsize="medium")
    figure.supylabel("return of greedy episodes", fontsize="medium")
    if len(variants) > 1:
        figure.suptitle(
            f"blue: the variant, grey: {first}; bands: 95 % of the mean", fontsize="medium"
        )
    return figure


def _curves(runs: Sequence[Run]) -> list[tuple[np.ndarray, np.ndarray]]:
    found = [evaluation_curve(run) for run in runs]
    return [(curve.steps, curve.values) for curve in found if len(curve.values)]


def _finish(axes: Axes, title: str, line: float | None) -> None:
    axes.set_title(title, fontsize="small")
    axes.grid(alpha=0.3)
    axes.tick_params(labelsize="x-small")
    if line is not None:
        axes.axhline(line, color="tab:red", linestyle="--", linewidth=0.8)
