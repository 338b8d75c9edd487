"""A display that nobody sees, and what is on it."""

import shutil
import struct
import subprocess
import tempfile
from pathlib import Path
from types import TracebackType

import numpy as np

FIELDS = 25  # numbers of an XWD header
COLOR = 12  # [bytes] of an entry of its colour map


def missing(*programs: str) -> str:
    """The first of the programs that isn't installed; empty if all are."""
    return next((program for program in programs if shutil.which(program) is None), "")


class VirtualDisplay:
    """Xvfb with a screen of 1280 x 800, for as long as the block."""

    def __enter__(self) -> "VirtualDisplay":
        self._folder = tempfile.TemporaryDirectory()
        command = [
            "Xvfb",
            "-displayfd",
            "1",
            "-screen",
            "0",
            "1280x800x24",
            "-fbdir",
            self._folder.name,
        ]
        self._server = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
        )
        assert self._server.stdout is not None
        self.name = f":{self._server.stdout.readline().strip()}"
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._server.terminate()
        self._server.wait()
        assert self._server.stdout is not None
        self._server.stdout.close()
        self._folder.cleanup()

    def screenshot(self) -> np.ndarray:
        """What is on the screen: (800, 1280, 3) of uint8."""
        data = Path(self._folder.name, "Xvfb_screen0").read_bytes()
        header = struct.unpack_from(f">{FIELDS}I", data)
        size, width, height, line, colors = header[0], header[4], header[5], header[12], header[19]
        start = size + COLOR * colors
        rows = np.frombuffer(data, np.uint8, height * line, start).reshape(height, line)
        return rows[:, : 4 * width].reshape(height, width, 4)[..., 2::-1]
