"""Results on disk: each file whole, or as it was before."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, BinaryIO

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from rl_workbench.errors import WorkbenchError
from rl_workbench.training.run.files import write_atomically

DPI = 110


def write_file(path: Path, write: Callable[[BinaryIO], object]) -> None:
    """Lets `write` fill a file, which replaces an older one only once it is whole.

    Raises:
        WorkbenchError: if the disk refuses.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(path, write)
    except OSError as error:
        raise WorkbenchError(f"can't write {path}: {error.strerror or error}") from error


def check_writable(path: Path) -> None:
    """Refuses a place where nothing can be written, before hours are spent on what goes there.

    Raises:
        WorkbenchError: if it is one.
    """
    if path.is_dir():
        raise WorkbenchError(f"can't write {path}: it is a folder")
    probe = path.with_name(f".{path.name}.probe")
    write_file(probe, lambda stream: None)
    probe.unlink()


def write_json(path: Path, content: Any) -> None:
    """Writes JSON with an end of line.

    Raises:
        WorkbenchError: if the disk refuses.
    """
    text = json.dumps(content, indent=1, allow_nan=False) + "\n"
    write_file(path, lambda stream: stream.write(text.encode()))


def new_figure(width: float, height: float) -> Figure:
    """An empty figure [inches] that needs no display."""
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def write_figure(path: Path, figure: Figure) -> None:
    """Writes a picture as PNG.

    Raises:
        WorkbenchError: if the disk refuses, or the name says another format.
    """
    if path.suffix.lower() != ".png":
        raise WorkbenchError(f"pictures are PNG: name one that ends in .png, not {path}")
    write_file(path, lambda stream: figure.savefig(stream, format="png", dpi=DPI))
