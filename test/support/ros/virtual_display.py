"""A virtual display, and what is on it."""

import contextlib
import shutil
import struct
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

FIELDS = 25  # numbers of an XWD header
COLOR = 12  # [bytes] of an entry of its colour map


def missing(*programs: str) -> str:
    """The first of the programs that isn't installed; empty if all are."""
    return next((program for program in programs if shutil.which(program) is None), "")


class Display(NamedTuple):
    """What a program finds as DISPLAY, and the folder with the picture of its screen."""

    name: str
    folder: Path

    def screenshot(self) -> np.ndarray:
        """What is on the screen: (800, 1280, 3) of uint8."""
        data = (self.folder / "Xvfb_screen0").read_bytes()
        header = struct.unpack_from(f">{FIELDS}I", data)
        size, width, height, line, colors = header[0], header[4], header[5], header[12], header[19]
        start = size + COLOR * colors
        rows = np.frombuffer(data, np.uint8, height * line, start).reshape(height, line)
        return rows[:, : 4 * width].reshape(height, width, 4)[..., 2::-1]


@contextlib.contextmanager
def virtual_display() -> Iterator[Display]:
    """Xvfb with a screen of 1280 x 800, for as long as the block."""
    with tempfile.TemporaryDirectory() as folder:
        screen = ["-screen", "0", "1280x800x24", "-fbdir", folder]
        command = ["Xvfb", "-displayfd", "1", *screen]
        with subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
        ) as server:
            assert server.stdout is not None
            try:
                yield Display(f":{server.stdout.readline().strip()}", Path(folder))
            finally:
                server.terminate()
