"""Episodes as they are seen: what a video is made of; needs no display."""

import inspect
import os
from collections.abc import Callable, Iterator, Sequence
from io import BytesIO
from typing import Any, NamedTuple

import gymnasium
import numpy as np
from gymnasium.envs.registration import load_env_creator
from PIL import Image, ImageDraw, ImageFont

from rl_workbench.env_ids import spec_of
from rl_workbench.errors import WorkbenchError
from rl_workbench.tools.runs.episodes import episode_steps

Act = Callable[[Any], Any]
Size = tuple[int, int]
"""Width and height [pixels]."""

DISPLAYS = ("DISPLAY", "WAYLAND_DISPLAY")  # either of them names one
DEFAULT_RATE = 30.0  # [Hz] of an environment that doesn't tell its own
TEXT, PAPER = (40, 44, 52), (255, 255, 255)
LINES = 14.0  # of text that would fit into a picture's height
MOST_NUMBERS = 3  # of an action that has many


class Player(NamedTuple):
    """A policy in its environment."""

    title: str  # that captions begin with
    env: gymnasium.Env[Any, Any]
    act: Act


class Shot(NamedTuple):
    """A moment of an episode."""

    caption: str
    length: int  # [steps]
    total_reward: float
    success: bool | None = None  # at the end, if the environment says


class Film(NamedTuple):
    """An episode that was seen. Frames are PNG: thousands of them are kept."""

    frames: list[bytes]
    rate: float  # [Hz] of the frames, in simulated time
    end: Shot


class Recorded(NamedTuple):
    """What a file shows: the last moment of each episode, and so many frames in that time [s]."""

    ends: list[Shot]
    frames: int
    seconds: float


def draw_without_display() -> None:
    """Has pygame look for no screen, and MuJoCo for none where there is none; before they are imported."""
    os.environ.setdefault("SDL_VIDEODRIVER", "dummy")
    if not any(os.environ.get(name) for name in DISPLAYS):
        os.environ.setdefault("MUJOCO_GL", "egl")


def size_options(env_id: str, size: Size | None) -> dict[str, int]:
    """Options that may make an environment draw pictures of that size; none if it has no such options."""
    if size is None:
        return {}
    spec = spec_of(env_id)
    entry_point = None if spec is None else spec.entry_point
    maker = load_env_creator(entry_point) if isinstance(entry_point, str) else entry_point
    if maker is None:
        return {}
    known = inspect.signature(maker).parameters
    given = {"width": size[0], "height": size[1]}
    takes_all = any(each.kind is each.VAR_KEYWORD for each in known.values())
    return given if takes_all or given.keys() <= known.keys() else {}


def film_episode(
    player: Player,
    seed: int,
    fastest: float,
    *,
    longest: int = 0,
    size: Size | None = None,
    captions: bool = True,
) -> Film:
    """Plays one episode and keeps every frame that a video of at most `fastest` [Hz] shows.

    Args:
        longest: number of steps after which it is cut off; 0: never.
        size: of the pictures [pixels]; by default as they are drawn.
        captions: tell step, return and action below the pictures.

    Raises:
        WorkbenchError: if the environment draws no pictures.
    """
    rate, stride = frame_rate(player.env, fastest)
    frames = []
    for shot in shots(player, seed, stride, longest):
        picture = take_picture(player.env, size)
        frames.append(packed(_captioned(picture, shot.caption) if captions else picture))
    return Film(frames, rate, shot)


def frame_rate(env: gymnasium.Env[Any, Any], fastest: float) -> tuple[float, float]:
    """Frames a second [Hz] of a video of at most `fastest` [Hz], and steps from one frame to the next."""
    rate = float(env.metadata.get("render_fps") or DEFAULT_RATE)
    stride = max(1.0, rate / fastest)
    return rate / stride, stride


def shots(player: Player, seed: int, stride: float, longest: int = 0) -> Iterator[Shot]:
    """Plays one episode; stops wherever a video has a frame, at the end in any case.

    Args:
        stride: steps from one frame to the next, on average.
        longest: number of steps after which it is cut off; 0: never.
    """
    total, due = 0.0, 0.0
    for length, step in enumerate(episode_steps(player.env, player.act, seed, longest)):
        total += step.reward
        if length < due and not step.finished:
            continue
        caption = _caption(player.title, length, total, step.action)
        yield Shot(caption, length, total, step.success)
        while due <= length:
            due += stride


class SideBySide(Sequence[np.ndarray]):
    """The frames of all films at once, (H, W, 3) of uint8; one that is over shows its last frame."""

    def __init__(self, films: Sequence[Film]) -> None:
        self._films = films

    def __len__(self) -> int:
        return max(len(film.frames) for film in self._films)

    def __getitem__(self, index: Any) -> Any:
        if index >= len(self):
            raise IndexError(index)
        kept = [film.frames[min(index, len(film.frames) - 1)] for film in self._films]
        shown = [Image.open(BytesIO(each)) for each in kept]
        size = sum(each.width for each in shown), max(each.height for each in shown)
        sheet, left = Image.new("RGB", size, PAPER), 0
        for each in shown:
            sheet.paste(each, (left, 0))
            left += each.width
        return np.asarray(sheet)


def take_picture(env: gymnasium.Env[Any, Any], size: Size | None = None) -> Image.Image:
    """What the environment draws of itself, in a size [pixels] of its own or a given one.

    Raises:
        WorkbenchError: if it draws no pictures.
    """
    try:
        drawn: Any = env.render()
    except (
        gymnasium.error.Error,
        WorkbenchError,
    ) as error:  # something isn't installed, or the robot isn't there
        raise WorkbenchError(f"the environment can't be drawn: {error}") from error
    if not isinstance(drawn, np.ndarray):
        raise WorkbenchError("the environment draws no pictures")
    picture = Image.fromarray(drawn)
    if size in (None, picture.size):
        return picture
    assert size is not None
    return picture.resize(size, Image.Resampling.LANCZOS)


def _caption(title: str, step: int, total: float, action: Any) -> str:
    told = [title] if title else []
    told += [f"step {step}", f"return {total:.1f}"]
    return "   ".join([*told, *([] if action is None else [f"action {action_text(action)}"])])


def action_text(action: Any) -> str:
    """An action in some characters."""
    numbers = np.ravel(action)
    if np.issubdtype(numbers.dtype, np.integer):
        words = [str(number) for number in numbers[:MOST_NUMBERS]]
    else:
        words = [f"{number:+.2f}" for number in numbers[:MOST_NUMBERS]]
    return " ".join([*words, *(["..."] if len(numbers) > MOST_NUMBERS else [])])


def _captioned(picture: Image.Image, text: str) -> Image.Image:
    """With a line of text below; of a size that it fits into the width."""
    high = max(8, round(picture.height / LINES))
    font = ImageFont.load_default(0.7 * high)
    width = font.getlength(text)
    room = picture.width - high
    if width > room > 0:
        font = ImageFont.load_default(max(6.0, 0.7 * high * room / width))
    sheet = Image.new("RGB", (picture.width, picture.height + high), PAPER)
    sheet.paste(picture, (0, 0))
    middle = picture.height + high / 2.0
    ImageDraw.Draw(sheet).text((high / 2.0, middle), text, TEXT, font, anchor="lm")
    return sheet


def packed(picture: Image.Image) -> bytes:
    """A picture as PNG."""
    stream = BytesIO()
    picture.convert("RGB").save(stream, "PNG", compress_level=1)
    return stream.getvalue()
