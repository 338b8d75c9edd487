"""Figures that need no display."""

from collections.abc import Callable
from typing import BinaryIO

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

DPI = 110


def new_figure(width: float, height: float) -> Figure:
    """An empty figure [inches]."""
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def as_png(figure: Figure) -> Callable[[BinaryIO], object]:
    """Writes a figure into a file."""
    return lambda stream: figure.savefig(stream, format="png", dpi=DPI)
