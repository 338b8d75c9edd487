"""The learning curve as a picture; needs no display."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from rl_workbench.training.run.files import write_atomically

WINDOW = 20  # [episodes] of the moving average


def moving_average(values: Sequence[float], window: int = WINDOW) -> np.ndarray:
    """The mean of the last `window` values (of fewer at the start); same length as `values`."""
    sums = np.concatenate([[0.0], np.cumsum(np.asarray(values, dtype=float))])
    ends = np.arange(1, len(sums))
    starts = np.maximum(ends - window, 0)
    return (sums[ends] - sums[starts]) / (ends - starts)


def learning_curve(
    path: Path, lengths: Sequence[int], returns: Sequence[float], title: str
) -> None:
    """Draws length and return of every episode, each with its moving average, as a PNG.

    Raises:
        OSError: if the file can't be written; an older one is untouched.
    """
    figure = Figure(figsize=(9, 6), layout="constrained")
    FigureCanvasAgg(figure)
    upper, lower = figure.subplots(2, 1, sharex=True)
    _draw(upper, lengths, "episode length [steps]", "tab:blue")
    _draw(lower, returns, "return", "tab:green")
    upper.set_title(title)
    upper.legend(loc="upper left")
    lower.set_xlabel("episode")
    write_atomically(path, lambda stream: figure.savefig(stream, format="png", dpi=110))


def _draw(axes: Axes, values: Sequence[float], label: str, colour: str) -> None:
    episodes = np.arange(len(values))
    axes.plot(episodes, values, ".", markersize=3, alpha=0.45, color=colour, label="one episode")
    axes.plot(
        episodes,
        moving_average(values),
        color="tab:red",
        linewidth=1.8,
        label=f"mean of {WINDOW} episodes",
    )
    axes.set_ylabel(label)
    axes.grid(alpha=0.3)
