"""`record`: writes episodes as GIF or MP4."""

import argparse
import contextlib
import shutil
from collections.abc import Sequence
from io import BytesIO
from itertools import accumulate, pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, NamedTuple

from file_access.locks import scratch_folder
from rl_workbench.errors import WorkbenchError, need
from rl_workbench.starting import Interrupt
from rl_workbench.tools.flags import POLICIES, add_policy_flags, env_options, number, typed_values
from rl_workbench.training.progress import tell

if TYPE_CHECKING:
    import numpy as np
    from PIL.Image import Image

    from rl_workbench.tools.policies import Player
    from rl_workbench.tools.recording import EpisodeFrame
    from rl_workbench.tools.runs import Run

RATES = {".gif": 25.0, ".mp4": 50.0}  # [Hz] by default, by the suffix
MAX_GIF_RATE = 50.0  # [Hz]; browsers slow down faster ones
GIF_TICK = 10  # [ms], the format's own
COLOURS = 96  # of a GIF; drawings have few
TEXT, PAPER = (40, 44, 52), (255, 255, 255)
FADED = 0.4  # share of white in the picture of an episode that has ended
LINES = 14.0  # lines of text that fit into a picture's height


class Film(NamedTuple):
    """A recorded episode."""

    title: str
    frames: "list[EpisodeFrame]"
    rate: float  # of the frames [Hz], in simulated time


def add_flags(parser: argparse.ArgumentParser) -> None:
    """Adds the flags of the command."""
    add_policy_flags(parser, POLICIES, several=True)
    add = parser.add_argument
    add("--out", type=Path, required=True, metavar="FILE", help="ends in .gif or .mp4")
    add("--max-steps", type=number(0), default=0, metavar="N",
        help="cut the episode off after N steps; 0: never (default)")  # fmt: skip
    add("--size", type=_size, metavar="WIDTHxHEIGHT",
        help="size of the pictures [pixels] (default: the environment's)")  # fmt: skip
    add("--camera", nargs="+", default=[], metavar="KEY=VALUE",
        help="fields of the environment's camera, e.g. distance=2.5 yaw=90 target=[0,0,0.3]")  # fmt: skip
    add("--fps", type=_rate, metavar="HZ",
        help="frames per second of simulated time (default 25; 50 for an MP4)")  # fmt: skip
    add("--no-captions", action="store_true", help="no line with step, return and action")


def _size(text: str) -> tuple[int, int]:
    words = text.lower().split("x")
    if len(words) != 2 or not all(word.isdecimal() and 16 <= int(word) <= 4096 for word in words):
        raise argparse.ArgumentTypeError(f"must be WIDTHxHEIGHT, 16x16 to 4096x4096: {text}")
    return int(words[0]), int(words[1])


def _rate(text: str) -> float:
    value = float(text)
    if not 0.1 <= value <= 240.0:
        raise argparse.ArgumentTypeError(f"must lie between 0.1 and 240: {text}")
    return value


def run(arguments: argparse.Namespace, interrupt: Interrupt) -> None:
    """Records an episode of each policy, and writes the file."""
    from rl_workbench.storage import check_writable
    from rl_workbench.tools.recording import draw_without_display
    from rl_workbench.tools.runs import open_run

    out, run = arguments.out, open_run(arguments.run)
    suffix = out.suffix.lower()
    if suffix not in RATES:
        raise WorkbenchError(f"a video's name ends in {' or '.join(RATES)}: not {out}")
    if suffix == ".mp4":
        need("imageio_ffmpeg", "imageio-ffmpeg", "an MP4")
    rate = arguments.fps or RATES[suffix]
    if suffix == ".gif" and rate > MAX_GIF_RATE:
        raise WorkbenchError(f"--fps: a GIF has at most {MAX_GIF_RATE:g} frames a second")
    check_writable(out)
    draw_without_display()
    tell(f"recording {', '.join(arguments.checkpoint)} of {arguments.run}")
    with contextlib.ExitStack() as stack:
        policies = {}
        for which in arguments.checkpoint:
            policies[which] = _policy(arguments, run, which)
            stack.callback(policies[which].env.close)
        films = [_record(arguments, *named, rate) for named in policies.items()]
        write_video(out, SideBySide(films, not arguments.no_captions), films[0].rate)
    for film in films:
        title, end = f"{film.title}: " if film.title else "", film.frames[-1]
        words = {None: "", True: ", success", False: ", no success"}[end.success]
        tell(f"{title}return {end.total_reward:.2f} in {end.step} steps{words}")
    count = max(len(film.frames) for film in films)
    tell(f"{out}: {count} frames, {count / films[0].rate:.1f} s")


def _policy(arguments: argparse.Namespace, run: "Run", which: str) -> "Player":
    from rl_workbench.tools.policies import load_any

    options = {**env_options(arguments), "render_mode": "rgb_array"}
    if arguments.camera:
        options["camera"] = typed_values(arguments.camera, "--camera")
    if arguments.size:
        sized = dict(zip(("width", "height"), arguments.size, strict=True))
        try:
            return load_any(run, which, {**options, **sized}, arguments.seed)
        except WorkbenchError as error:
            if not isinstance(error.__cause__, TypeError):  # no such options: pictures are scaled
                raise
    return load_any(run, which, options, arguments.seed)


def _record(arguments: argparse.Namespace, which: str, policy: "Player", rate: float) -> Film:
    from rl_workbench.tools.policies import TEST_SEED
    from rl_workbench.tools.recording import PictureView, record_episode, step_rate

    steps, view = step_rate(policy.env), PictureView(policy.env, size=arguments.size)
    stride = max(1.0, steps / rate)
    frames = record_episode(policy.env, policy.act, view, TEST_SEED + arguments.seed,
                            stride=stride, max_steps=arguments.max_steps)  # fmt: skip
    title = which if len(arguments.checkpoint) > 1 else ""
    return Film(title, list(frames), steps / stride)


class SideBySide(Sequence["np.ndarray"]):
    """The pictures of all films side by side, (H, W, 3) uint8; a finished film shows its last one."""

    def __init__(self, films: Sequence[Film], captions: bool) -> None:
        self._films, self._captions = films, captions

    def __len__(self) -> int:
        return max(len(film.frames) for film in self._films)

    def __getitem__(self, index: Any) -> Any:
        import numpy as np
        from PIL import Image

        if index >= len(self):
            raise IndexError(index)
        pictures = []
        for film in self._films:
            frame = film.frames[min(index, len(film.frames) - 1)]
            picture: Image.Image = Image.open(BytesIO(frame.seen))
            if frame.ended:
                picture = Image.blend(picture, Image.new("RGB", picture.size, PAPER), FADED)
            pictures.append(_captioned(picture, frame.caption(film.title)) if self._captions else picture)
        size = sum(each.width for each in pictures), max(each.height for each in pictures)
        sheet, left = Image.new("RGB", size, PAPER), 0
        for each in pictures:
            sheet.paste(each, (left, 0))
            left += each.width
        return np.asarray(sheet)


def _captioned(picture: "Image", text: str) -> "Image":
    """Returns the picture with a line of text below, in a size that fits the width."""
    from PIL import Image, ImageDraw, ImageFont

    high = max(8, round(picture.height / LINES))
    font = ImageFont.load_default(0.7 * high)
    width, room = font.getlength(text), picture.width - high
    if width > room > 0:
        font = ImageFont.load_default(max(6.0, 0.7 * high * room / width))
    sheet = Image.new("RGB", (picture.width, picture.height + high), PAPER)
    sheet.paste(picture, (0, 0))
    middle = picture.height + high / 2.0
    ImageDraw.Draw(sheet).text((high / 2.0, middle), text, TEXT, font, anchor="lm")
    return sheet


def write_video(path: Path, frames: "Sequence[np.ndarray]", rate: float) -> None:
    """Writes frames (H, W, 3) of uint8, `rate` a second, in the format of the suffix; atomically."""
    from rl_workbench.storage import write_file

    write = {".gif": _write_gif, ".mp4": _write_mp4}[path.suffix.lower()]
    write_file(path, lambda stream: write(stream, frames, rate))


def _write_gif(stream: BinaryIO, frames: "Sequence[np.ndarray]", rate: float) -> None:
    """Writes a GIF. All frames share a palette from three of them, so that only changes are stored."""
    import numpy as np
    from PIL import Image

    some = np.concatenate([frames[0], frames[len(frames) // 2], frames[len(frames) - 1]])
    palette = Image.fromarray(some).quantize(COLOURS, Image.Quantize.MAXCOVERAGE)
    reduced = [Image.fromarray(each).quantize(palette=palette, dither=Image.Dither.NONE) for each in frames]
    # Each frame lasts whole ticks; on average they last 1 / rate.
    ticks = accumulate([1000.0 / rate / GIF_TICK] * len(reduced), initial=0.0)
    reduced[0].save(
        stream, format="GIF", save_all=True, append_images=reduced[1:], loop=0, optimize=False,
        duration=[GIF_TICK * (round(end) - round(begin)) for begin, end in pairwise(ticks)],
    )  # fmt: skip


def _write_mp4(stream: BinaryIO, frames: "Sequence[np.ndarray]", rate: float) -> None:
    """Writes an MP4 by way of a temporary file, since ffmpeg can't write this format to a stream."""
    from web_viewer.video import EncoderFailed, Mp4Writer

    with scratch_folder() as folder:
        path = folder / "video.mp4"
        writer = Mp4Writer(path, rate)
        try:
            for frame in frames:
                writer.add(frame)
            writer.close()
        except EncoderFailed as error:
            raise WorkbenchError(str(error)) from error
        with path.open("rb") as made:
            shutil.copyfileobj(made, stream)
