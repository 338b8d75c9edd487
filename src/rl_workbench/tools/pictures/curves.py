"""Learning curves of groups of runs: a mean over seeds with its bootstrap interval as a band."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rl_workbench.errors import WorkbenchError
from rl_workbench.tools.benchmark.comparison import group_of
from rl_workbench.tools.benchmark.statistics import bands
from rl_workbench.tools.runs.runs import Run, threshold, training_curve
from rl_workbench.training.run.learning_curve import WINDOW, moving_average
from rl_workbench.training.run.results import new_figure

POINTS = 100  # of a curve


def learning_curves(runs: Sequence[Run]) -> Figure:
    """One curve for each group that has episodes.

    Raises:
        WorkbenchError: if none has.
    """
    figure = new_figure(10, 5)
    axes = figure.subplots()
    names = sorted({group_of(run) for run in runs})
    drawn = [
        _draw(axes, name, f"C{index % 10}", [run for run in runs if group_of(run) == name])
        for index, name in enumerate(names)
    ]
    if not any(drawn):
        raise WorkbenchError("no episode has ended yet in any of these runs")
    lines = {threshold(run.env_id) for run in runs}
    for line in sorted(each for each in lines if each is not None):
        axes.axhline(line, color="tab:red", linestyle="--", label=f"solved ({line:g})")
    about = f"mean over seeds (each over {WINDOW} episodes), with its 95% interval"
    axes.set_title(f"{about}; dashed: of fewer runs")
    axes.set_xlabel("step of the environment")
    axes.set_ylabel("return")
    axes.grid(alpha=0.3)
    axes.legend(fontsize="small")
    return figure


def _draw(axes: Axes, name: str, colour: str, runs: Sequence[Run]) -> bool:
    curves = [curve for run in runs if (curve := _curve(run)) is not None]
    if curves:
        draw_band(axes, curves, colour, f"{name} ({len(curves)} runs)")
    return bool(curves)


def draw_band(
    axes: Axes, curves: Sequence[tuple[np.ndarray, np.ndarray]], colour: str, label: str
) -> None:
    """The mean of curves (steps, values) with its interval; dashed where some have ended."""
    grid = np.linspace(0.0, max(steps[-1] for steps, _ in curves), POINTS)
    table = np.array([_on_grid(grid, *curve) for curve in curves])  # (runs, POINTS)
    middle, low, high = _summarised(table)
    whole = ~np.isnan(table).any(axis=0)  # elsewhere some of the runs have ended: dashed
    axes.plot(grid, middle, color=colour, linewidth=1.2, linestyle="--")
    axes.plot(grid, np.where(whole, middle, np.nan), color=colour, linewidth=2, label=label)
    axes.fill_between(grid, low, high, color=colour, alpha=0.2, linewidth=0)


def _curve(run: Run) -> tuple[np.ndarray, np.ndarray] | None:
    try:
        curve = training_curve(run)
    except WorkbenchError:
        return None  # the table names it
    return curve.steps, moving_average(curve.values.tolist())


def _on_grid(grid: np.ndarray, steps: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Linear in between; nothing before the first episode's end, nor after the last one's."""
    return np.interp(grid, steps, values, left=np.nan, right=np.nan)


def _summarised(table: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mean and interval at each point, of the runs that are there."""
    middle, low, high = (np.full(table.shape[1], np.nan) for _ in range(3))
    present = ~np.isnan(table)
    # Points where the same runs are present are done at once.
    for pattern in {tuple(column) for column in present.T if column.any()}:
        columns = np.all(pattern == present.T, axis=1)
        scores = table[np.array(pattern)][:, columns]
        middle[columns] = scores.mean(axis=0)
        if len(scores) > 1:
            low[columns], high[columns] = bands(scores, np.mean)
    return middle, low, high
