"""Learning curves as pictures, of one training or of many seeds; no display is needed.

Everything comes in as plain arrays, because a training at its end and the tools share this module.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, BinaryIO, NamedTuple

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from rl_workbench.statistics import bands

DPI = 110
WIDTH = 10.0  # [inches]; on a page that is narrower, 10-point letters can still be read
WINDOW = 20  # [episodes] of the moving average
POINTS = 200  # of a mean over seeds
MAX_PALE = 8  # runs whose single episodes are drawn; those of more would hide each other
COLUMNS = 4  # of small panels
# Red is reserved for the threshold, grey for the reference curve.
COLOURS = ("C0", "C1", "C2", "C4", "C5", "C6", "C8", "C9")
LINE_STYLES = ("-", "-.", ":")
STEPS = "step of the environment"
SUCCESS = "success rate, last 100 episodes"


class SeedCurve(NamedTuple):
    """The values of one training over its steps or episodes."""

    positions: np.ndarray  # (N,), ascending; N is at least 1
    values: np.ndarray  # (N,)
    complete: bool = True  # whether the training reached its end


class Panel(NamedTuple):
    """One pair of axes, for one environment."""

    environment: str
    curves: Mapping[str, Sequence[SeedCurve]]  # by the name of the group; at least one each
    threshold: float | None  # the return from which the environment counts as solved
    shows_success: bool = False  # success rates of the last episodes, 0 to 1, instead of returns


def new_figure(width: float, height: float) -> Figure:
    """Returns an empty figure of that size [inches]."""
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def as_png(figure: Figure) -> Callable[[BinaryIO], object]:
    """Returns a function that writes the figure to a file."""
    return lambda stream: figure.savefig(stream, format="png", dpi=DPI)


def moving_average(values: Sequence[float] | np.ndarray, window: int = WINDOW) -> np.ndarray:
    """Returns the mean of the last `window` values (fewer at the start), as long as `values`."""
    sums = np.concatenate([[0.0], np.cumsum(np.asarray(values, dtype=float))])
    ends = np.arange(1, len(sums))
    starts = np.maximum(ends - window, 0)
    return (sums[ends] - sums[starts]) / (ends - starts)


def mean_over_seeds(curves: Sequence[SeedCurve]) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Returns positions, mean over all seeds, and the ends of its 95 % interval, each (P,).

    They go from where each has a value to the end of the longest. A seed that has ended counts with its last
    value: otherwise the mean would fall whenever a good seed ends early.
    """
    positions = np.unique(np.concatenate([curve.positions for curve in curves]))
    positions = positions[positions >= max(curve.positions[0] for curve in curves)]
    if len(positions) > POINTS and len(curves) > 1:
        positions = np.linspace(positions[0], positions[-1], POINTS)
    table = np.array([np.interp(positions, curve.positions, curve.values) for curve in curves])
    mean = table.mean(axis=0)
    low, high = bands(table, np.mean) if len(curves) > 1 else (mean, mean)
    return positions, mean, low, high


def learning_curve(
    lengths: Sequence[int], returns: Sequence[float], title: str, successes: Sequence[bool] = ()
) -> Figure:
    """Draws one training: length [steps], return and success of every episode, with their moving averages."""
    parts: list[tuple[Sequence[float], str, str]] = [
        (lengths, "episode length [steps]", "tab:blue"),
        (returns, "return", "tab:green"),
    ]
    if len(successes) == len(returns):
        parts.append((successes, "success", "tab:purple"))
    figure = new_figure(9, 3 * len(parts))
    grid = figure.subplots(len(parts), 1, sharex=True)
    for axes, (values, label, colour) in zip(grid, parts, strict=True):
        episodes = np.arange(len(values))
        axes.plot(episodes, values, ".", ms=3, alpha=0.45, color=colour, label="one episode")
        average = f"mean of {WINDOW} episodes"
        axes.plot(episodes, moving_average(values), color="tab:red", lw=1.8, label=average)
        axes.set_ylabel(label)
        axes.grid(alpha=0.3)
    grid[0].set_title(title)
    grid[0].legend(loc="upper left")
    grid[-1].set_xlabel("episode")
    return figure


def training_curves(panels: Sequence[Panel], across: str) -> Figure:
    """Draws every run by itself, a group of its own: the return of each episode and the moving average."""
    figure, grid = _environments(panels)
    returns = [panel for panel in panels if not panel.shows_success]
    pale, styles = sum(len(panel.curves) for panel in returns) <= MAX_PALE, _styles(panels)
    for axes, panel in zip(grid, panels, strict=True):
        for name, (run,) in panel.curves.items():
            style = styles[name]
            if pale and not panel.shows_success:
                axes.plot(run.positions, run.values, gid="episodes", alpha=0.3, lw=0.9, **style)
            values = run.values if panel.shows_success else moving_average(run.values)
            axes.plot(run.positions, values, lw=2, label=name, **style)
        _finish(axes, panel, across, "return")
    about = f"mean of {WINDOW} episodes" + (", pale: each episode" if pale else "")
    figure.suptitle(f"training: {about}", fontsize="medium")
    _name_curves(figure)
    return figure


def seed_curves(panels: Sequence[Panel]) -> Figure:
    """Draws groups of seeds in a panel for each environment: moving averages of returns over the steps."""
    figure, grid = _environments(panels)
    styles = _styles(panels)
    for axes, panel in zip(grid, panels, strict=True):
        for name, seeds in panel.curves.items():
            averages = [
                each if panel.shows_success else each._replace(values=moving_average(each.values))
                for each in seeds
            ]
            _draw_seeds(axes, averages, f"{name} ({_seeds(seeds)})", styles[name])
        _finish(axes, panel, STEPS, f"return, mean of {WINDOW} episodes")
    _explain(figure, panels)
    _name_curves(figure)
    return figure


def evaluation_curves(panels: Sequence[Panel]) -> Figure:
    """Draws a small panel of evaluations for each variant, with the first one's mean in grey behind it."""
    first, environments = panels[0], {panel.environment for panel in panels}
    columns = min(COLUMNS, len(panels))
    rows = math.ceil(len(panels) / columns)
    figure = new_figure(max(3.2 * columns, 7.0), max(2.4 * rows, 3.0) + 0.9)
    grid = figure.subplots(
        rows, columns, sharex=len(environments) == 1, sharey=len(environments) == 1, squeeze=False
    )
    for axes, panel in zip(grid.flat, panels, strict=False):
        ((name, seeds),) = panel.curves.items()
        if panel is not first and panel.environment == first.environment:
            (behind,) = first.curves.values()
            axes.plot(*mean_over_seeds(behind)[:2], gid="reference", color="0.55", lw=1.5)
        _draw_seeds(axes, seeds, name, {"color": "tab:blue"})
        _draw_threshold(axes, panel.threshold)
        where = f", {panel.environment}" if len(environments) > 1 else ""
        axes.set_title(f"{name} ({_seeds(seeds)}){where}", fontsize="small")
        axes.grid(alpha=0.3)
        axes.tick_params(labelsize="x-small")
    for axes in grid.flat[len(panels) :]:
        axes.set_axis_off()
    figure.supxlabel(STEPS, fontsize="medium")
    figure.supylabel("return of greedy episodes", fontsize="medium")
    more = []
    if any(panel.environment == first.environment for panel in panels[1:]):
        name = next(iter(first.curves))
        more.append(Line2D([], [], color="0.55", lw=1.5, label=f"mean of {name}"))
    if any(panel.threshold is not None for panel in panels):
        more.append(Line2D([], [], color="tab:red", lw=1, ls="--", label="solved"))
    _explain(figure, panels, *more)
    return figure


def _environments(panels: Sequence[Panel]) -> tuple[Figure, list[Axes]]:
    """Makes axes, one pair for each environment, since their returns don't compare."""
    if len(panels) == 1:
        figure = new_figure(WIDTH, 5)
        return figure, [figure.subplots()]
    rows = math.ceil(len(panels) / 2)
    figure = new_figure(WIDTH, 3.6 * rows + 0.4)
    grid = list(figure.subplots(rows, 2, squeeze=False).flat)
    for axes in grid[len(panels) :]:
        figure.delaxes(axes)
    return figure, grid[: len(panels)]


def _styles(panels: Sequence[Panel]) -> dict[str, dict[str, Any]]:
    """Returns colour and line of each group, the same in all panels."""
    names = dict.fromkeys(name for panel in panels for name in panel.curves)
    count = len(COLOURS)
    return {
        name: {"color": COLOURS[i % count], "ls": LINE_STYLES[i // count % len(LINE_STYLES)]}
        for i, name in enumerate(names)
    }


def _draw_seeds(axes: Axes, seeds: Sequence[SeedCurve], label: str, style: Mapping[str, Any]) -> None:
    """Draws every seed thinly, where it ended, the mean over all seeds and its interval."""
    colour = style["color"]
    positions, mean, low, high = mean_over_seeds(seeds)
    if len(seeds) > 1:
        axes.fill_between(positions, low, high, color=colour, alpha=0.15, linewidth=0)
        for seed in seeds:
            axes.plot(seed.positions, seed.values, gid="seed", color=colour, lw=0.7, alpha=0.4)
    axes.plot(positions, mean, gid="mean", lw=2, label=label, **style)
    for complete, gid, marker, size in ((True, "ended", "o", 4), (False, "stopped", "x", 6)):
        ends = [(seed.positions[-1], seed.values[-1]) for seed in seeds if seed.complete == complete]
        if ends:
            axes.plot(*np.transpose(ends), marker, gid=gid, color=colour, ms=size, mew=1.5,
                      zorder=3, clip_on=False)  # fmt: skip


def _draw_threshold(axes: Axes, threshold: float | None, more: str = "") -> None:
    if threshold is not None:
        label = f"solved ({threshold:g}){more}"
        axes.axhline(threshold, gid="threshold", color="tab:red", ls="--", lw=1, label=label)


def _finish(axes: Axes, panel: Panel, across: str, up: str) -> None:
    if panel.threshold is not None and axes.dataLim.ymax >= panel.threshold:
        # Above all curves it would say that none of them learned: they explore, evaluations don't.
        _draw_threshold(axes, panel.threshold, ", without exploration")
    axes.set_title(panel.environment.rpartition(":")[2])
    axes.set_xlabel(across)
    axes.set_ylabel(SUCCESS if panel.shows_success else up)
    if panel.shows_success:
        axes.set_ylim(-0.05, 1.05)
    axes.grid(alpha=0.3)


def _name_curves(figure: Figure) -> None:
    """Adds one legend below all panels for their curves."""
    named = {each.get_label(): each for axes in figure.axes for each in axes.get_legend_handles_labels()[0]}
    handles = [*named.values()]
    figure.legend(handles=handles, loc="outside lower center", ncols=4, fontsize="small", frameon=False)


def _explain(figure: Figure, panels: Sequence[Panel], *more: Line2D) -> None:
    """Adds one legend above all panels for their lines and marks."""
    seeds = [each for panel in panels for group in panel.curves.values() for each in group]
    mean = "mean of all seeds, ended ones with their last value"
    handles: list[Artist] = [
        Line2D([], [], color="k", lw=2, label=mean),
        Patch(color="k", alpha=0.15, lw=0, label="its 95 % interval"),
        Line2D([], [], color="k", lw=0.7, alpha=0.6, label="a seed"),
        Line2D([], [], color="k", marker="o", ls="", ms=4, label="its end"),
    ]
    if not all(seed.complete for seed in seeds):
        handles.append(Line2D([], [], color="k", marker="x", ls="", ms=6, label="not complete"))
    handles += more
    columns = len(handles) if figure.get_figwidth() >= 10 else 3
    figure.legend(handles=handles, loc="outside upper center", ncols=columns, fontsize="small",
                  frameon=False)  # fmt: skip


def _seeds(seeds: Sequence[SeedCurve]) -> str:
    return f"{len(seeds)} seed{'s' if len(seeds) > 1 else ''}"
