"""One greedy episode as a GIF or an MP4; needs no display."""

import math
import shutil
import tempfile
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import gymnasium
import numpy as np
from PIL import Image

from rl_workbench.errors import WorkbenchError
from rl_workbench.extras import need
from rl_workbench.tools.runs.episodes import greedy_steps
from rl_workbench.tools.runs.policies import LearnedPolicy
from rl_workbench.training.run.files import write_file

GIF_RATE, MP4_RATE = 25.0, 50.0  # [Hz]; frames between them are left out
GIF_TICK = 10  # [ms], the format's own
COLOURS = 64  # of a GIF; drawings have few
FORMATS = (".gif", ".mp4")


class Video(NamedTuple):
    """An episode that was seen."""

    frames: list[np.ndarray]  # (H, W, 3), uint8
    rate: float  # [Hz] of the frames, in simulated time
    length: int  # [steps]
    total_reward: float


def check_format(path: Path) -> None:
    """Refuses what can't be written, before an episode is played.

    Raises:
        WorkbenchError: if the name's ending isn't known, or the writer isn't installed.
    """
    if path.suffix.lower() not in FORMATS:
        raise WorkbenchError(f"a video's name ends in {' or '.join(FORMATS)}: not {path}")
    if path.suffix.lower() == ".mp4":
        need("imageio_ffmpeg", "imageio-ffmpeg", "MP4, unlike GIF,")


def record_episode(policy: LearnedPolicy, seed: int, fastest: float, longest: int = 0) -> Video:
    """Plays one greedy episode and keeps every frame that a video of at most `fastest` [Hz] shows.

    Args:
        longest: number of steps after which it is cut off; 0: never.

    Raises:
        WorkbenchError: if the environment draws no pictures.
    """
    rate = float(policy.env.metadata.get("render_fps") or 30.0)
    stride = math.ceil(rate / fastest)
    frames, total = [], 0.0
    for length, (_, reward, finished) in enumerate(greedy_steps(policy, seed, longest)):
        total += reward
        if finished or length % stride == 0:
            frames.append(_picture(policy.env))
    return Video(frames, rate / stride, length, total)


def _picture(env: gymnasium.Env[Any, Any]) -> np.ndarray:
    try:
        picture: Any = env.render()
    except gymnasium.error.DependencyNotInstalled as error:
        raise WorkbenchError(f"the environment can't be drawn: {error}") from error
    if not isinstance(picture, np.ndarray):
        raise WorkbenchError("the environment draws no pictures")
    return picture


def write_video(path: Path, video: Video, scale: float = 1.0) -> None:
    """Writes it in the format that the name's ending says; replaces an older file as a whole.

    Args:
        scale: of width and height.

    Raises:
        WorkbenchError: if the disk refuses.
    """
    frames = [_scaled(frame, scale) for frame in video.frames]
    write = _write_gif if path.suffix.lower() == ".gif" else _write_mp4
    write_file(path, lambda stream: write(stream, frames, video.rate))


def _scaled(frame: np.ndarray, scale: float) -> Image.Image:
    picture = Image.fromarray(frame)
    width, height = (max(2, 2 * round(side * scale / 2)) for side in picture.size)  # MP4: even
    if (width, height) == picture.size:
        return picture
    return picture.resize((width, height), Image.Resampling.LANCZOS)


def _write_gif(stream: BinaryIO, frames: list[Image.Image], rate: float) -> None:
    """All frames share the colours of a middle one, so that only what moves is stored."""
    palette = frames[len(frames) // 2].quantize(COLOURS)
    reduced = [each.quantize(palette=palette, dither=Image.Dither.NONE) for each in frames]
    duration = max(2, round(1000.0 / rate / GIF_TICK)) * GIF_TICK
    reduced[0].save(
        stream,
        format="GIF",
        save_all=True,
        append_images=reduced[1:],
        duration=duration,
        loop=0,
        optimize=False,
    )


def _write_mp4(stream: BinaryIO, frames: list[Image.Image], rate: float) -> None:
    """ffmpeg writes files only, so it writes one beside."""
    with tempfile.TemporaryDirectory(prefix="cartpole_") as folder:
        path = Path(folder, "video.mp4")
        _encode(path, frames, rate)
        with path.open("rb") as made:
            shutil.copyfileobj(made, stream)


def _encode(path: Path, frames: list[Image.Image], rate: float) -> None:
    import imageio_ffmpeg  # an extra

    writer = imageio_ffmpeg.write_frames(
        str(path), frames[0].size, fps=rate, codec="libx264", macro_block_size=2, quality=8
    )
    writer.send(None)  # starts ffmpeg
    try:
        for frame in frames:
            writer.send(frame.convert("RGB").tobytes())
    except OSError as error:
        raise WorkbenchError(f"ffmpeg gave up: {error}") from error
    finally:
        writer.close()
