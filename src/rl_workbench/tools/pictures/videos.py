"""Frames as a GIF, an MP4, or a page that plays them."""

import base64
import shutil
import tempfile
from collections.abc import Sequence
from io import BytesIO
from itertools import accumulate, pairwise
from pathlib import Path
from typing import BinaryIO

import numpy as np
from PIL import Image

from rl_workbench.errors import WorkbenchError
from rl_workbench.storage import write_file
from viewer.video import EncoderFailed, Mp4Writer

RATES = {
    ".gif": 25.0,
    ".mp4": 50.0,
    ".html": 25.0,
}  # [Hz] by default, by the ending of a file's name
FASTEST = 50.0  # [Hz] of a GIF: browsers slow down what is faster
GIF_TICK = 10  # [ms], the format's own
PAGE = Path(__file__).with_name("page.html")
COLOURS = 96  # of a GIF; drawings have few


def check_format(path: Path) -> None:
    """Refuses what can't be written, before an episode is played.

    Raises:
        WorkbenchError: if the name's ending isn't known, or the writer isn't installed.
    """
    if path.suffix.lower() not in RATES:
        raise WorkbenchError(f"a video's name ends in {' or '.join(RATES)}: not {path}")


def default_rate(path: Path) -> float:
    """Frames a second [Hz] of a video whose rate nobody asked for."""
    return RATES[path.suffix.lower()]


def write_video(path: Path, frames: Sequence[np.ndarray], rate: float) -> None:
    """Writes it in the format that the name's ending says; replaces an older file as a whole.

    Args:
        frames: of one size, (H, W, 3) of uint8; at least one.
        rate: of the frames [Hz].

    Raises:
        WorkbenchError: if the disk or ffmpeg refuses.
    """
    write = {".gif": _write_gif, ".mp4": _write_mp4, ".html": _write_html}[path.suffix.lower()]
    write_file(path, lambda stream: write(stream, frames, rate))


def _write_gif(stream: BinaryIO, frames: Sequence[np.ndarray], rate: float) -> None:
    """All frames share the colours of some of them, so that only what moves is stored."""
    some = np.concatenate([frames[0], frames[len(frames) // 2], frames[len(frames) - 1]])
    palette = Image.fromarray(some).quantize(COLOURS, Image.Quantize.MAXCOVERAGE)
    reduced = [
        Image.fromarray(each).quantize(palette=palette, dither=Image.Dither.NONE) for each in frames
    ]
    # Frames last whole ticks: on average as long as they should.
    ticks = accumulate([1000.0 / rate / GIF_TICK] * len(reduced), initial=0.0)
    reduced[0].save(
        stream,
        format="GIF",
        save_all=True,
        append_images=reduced[1:],
        duration=[GIF_TICK * (round(end) - round(begin)) for begin, end in pairwise(ticks)],
        loop=0,
        optimize=False,
    )


def _write_html(stream: BinaryIO, frames: Sequence[np.ndarray], rate: float) -> None:
    """All in one file: pictures as WebP in text, and a script that shows them."""
    height, width, _ = frames[0].shape
    begin, end = PAGE.read_text(encoding="utf-8").split("@FRAMES@")
    begin = begin.replace("@WIDTH@", str(width)).replace("@HEIGHT@", str(height))
    begin = begin.replace("@RATE@", f"{rate:g}")
    stream.write(begin.encode())
    for frame in frames:
        packed = BytesIO()
        Image.fromarray(frame).save(packed, "WEBP", quality=80)
        stream.write(b'"' + base64.b64encode(packed.getvalue()) + b'",\n')
    stream.write(end.encode())


def _write_mp4(stream: BinaryIO, frames: Sequence[np.ndarray], rate: float) -> None:
    """ffmpeg writes files only, so it writes one beside."""
    with tempfile.TemporaryDirectory(prefix="cartpole_") as folder:
        path = Path(folder, "video.mp4")
        writer = Mp4Writer(path, rate)
        try:
            try:
                for frame in frames:
                    writer.add(frame)
            finally:
                writer.close()
        except EncoderFailed as error:
            raise WorkbenchError(str(error)) from error
        with path.open("rb") as made:
            shutil.copyfileobj(made, stream)
