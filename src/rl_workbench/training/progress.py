"""What the user sees while training: a bar on a terminal, and a line every 20 episodes."""

import contextlib
import io
import os
import sys
import time
from collections.abc import Sequence
from typing import Any, TextIO

from tqdm import tqdm

LINE_EVERY = 20  # [episodes]
REFRESH = 0.1  # [s]
WIDTH = 100  # [columns] of the bar on a terminal that doesn't tell its size


def tell(text: str, stream: TextIO | None = None) -> None:
    """Tells the user, at once also when the output is a pipe; one that is gone costs no training.

    Nor does a sign that the output's encoding doesn't have: it comes as its number.
    """
    with contextlib.suppress(OSError):
        print(writable(text, stream or sys.stdout), file=stream, flush=True)


def writable(text: str, stream: TextIO | None) -> str:
    """`text` with backslashes for what the stream can't write, as the path of a folder may hold."""
    encoding = getattr(stream, "encoding", None) or "utf-8"
    return text.encode(encoding, "backslashreplace").decode(encoding)


def warn(text: str) -> None:
    """Tells the user beside the results."""
    tell(text, sys.stderr)


def _has_size(stream: TextIO) -> bool:
    """Whether the terminal tells its size: tqdm would draw a bar of no width on one that doesn't."""
    try:
        return os.get_terminal_size(stream.fileno()).columns > 0
    except (OSError, ValueError):
        return False


def _terminal_bar(total: int, unit: str, stream: TextIO, done: int) -> tqdm:
    """An empty bar that suits the terminal."""
    sized = _has_size(stream)
    return tqdm(
        total=total,
        initial=done,
        unit=unit,
        file=stream,
        dynamic_ncols=sized,
        ncols=None if sized else WIDTH,
        nrows=None if sized else 2,
    )


class Progress:
    """A bar over what the training's length is counted in, and lines.

    Args:
        total: steps or episodes of the whole training.
        unit: which of them, "step" or "episode".
        done: of these, what was done before.
        stream: where it goes; standard error unless told otherwise.
    """

    def __init__(self, total: int, unit: str, done: int, stream: TextIO | None = None) -> None:
        self._stream = stream or sys.stderr or io.StringIO()  # it may have been closed by 2>&-
        self._counts_steps = unit == "step"
        self._done = self._shown = done
        self._time = time.monotonic()
        self._bar: Any = None
        if self._stream.isatty():
            self._bar = _terminal_bar(total, unit, self._stream, done)

    def step_done(self, steps: int) -> None:
        """Moves a bar of steps, now and then."""
        if self._counts_steps:
            self._advance(steps)

    def _advance(self, done: int) -> None:
        self._done = done
        if self._bar is not None and time.monotonic() - self._time > REFRESH:
            self._move()

    def _move(self) -> None:
        self._bar.update(self._done - self._shown)
        self._shown, self._time = self._done, time.monotonic()

    def episode_done(self, returns: Sequence[float], length: int, speed: str, note: str) -> None:
        """Puts an episode's figures beside the bar; of every 20th one there is a line.

        Args:
            returns: of all episodes so far.
            length: of the last one [steps].
            speed: in steps a second, as a text.
            note: what the algorithm says of itself; the speed if it is empty.
        """
        if not self._counts_steps:
            self._advance(len(returns))
        if self._bar is not None:
            parts = [f"return {returns[-1]:.0f}", f"length {length}", note.replace(":", ""), speed]
            self._bar.set_postfix_str(", ".join(filter(None, parts)), refresh=False)
        if len(returns) % LINE_EVERY == 0:
            mean = sum(returns[-LINE_EVERY:]) / LINE_EVERY
            self.say(
                f"Episode {len(returns):4d} | Reward: {returns[-1]:3.0f} | "
                f"Avg({LINE_EVERY}): {mean:6.1f} | {note or speed}"
            )

    def say(self, text: str) -> None:
        """A line of its own, above the bar."""
        if self._bar is not None:
            self._bar.write(writable(text, self._stream), file=self._stream)
        else:
            tell(text, self._stream)

    def close(self) -> None:
        """Ends the bar, where the training has come to."""
        if self._bar is not None:
            self._move()
            self._bar.close()
