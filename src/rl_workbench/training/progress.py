"""Progress output: a bar on a terminal, and a line every 20 episodes."""

import contextlib
import io
import sys
import time
from collections.abc import Callable
from typing import Any, TextIO

from rl_workbench.training.callbacks import Callback, EpisodeResult

LINE_EVERY = 20  # [episodes]
SILENCE = 60.0  # [s] without a line


def tell(text: str, stream: TextIO | None = None) -> None:
    """Prints a line and flushes it. A closed stream can't make this fail."""
    with contextlib.suppress(OSError):
        print(text, file=stream, flush=True)


def warn(text: str) -> None:
    """Prints a line to standard error."""
    tell(text, sys.stderr)


class Progress(Callback):
    """A bar over the training's length, `total` of a unit ("step" or "episode"), and lines."""

    def __init__(
        self,
        total: int,
        unit: str,
        done: int,
        stream: TextIO | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._clock, self._told, self._total = clock, clock(), total
        self._stream = stream or sys.stderr or io.StringIO()  # it may have been closed by 2>&-
        self._counts_steps = unit == "step"
        self._bar: Any = None
        if self._stream.isatty():
            from tqdm import tqdm

            self._bar = tqdm(total=total, initial=done, unit=unit, file=self._stream, dynamic_ncols=True)

    def on_step(self, training: Any) -> None:
        if self._counts_steps:
            self._advance(training.steps)
        if self._bar is None and self._clock() - self._told >= SILENCE:
            total = f" of {self._total}" if self._counts_steps else ""
            self.say(f"step {training.steps}{total}, episode {len(training.history.returns) + 1}")

    def on_episode(self, training: Any, episode: EpisodeResult) -> None:
        if not self._counts_steps:
            self._advance(episode.number)
        returns, speed = training.history.returns, f"{episode.speed:.0f} steps/s"
        rate = f"success: {training.history.success_rate:.0%}" if training.history.successes else ""
        note = ", ".join(filter(None, [rate, episode.note]))
        if self._bar is not None:
            last = f"return {episode.total_reward:.0f}, length {episode.length}"
            parts = [last, note.replace(":", ""), speed]
            self._bar.set_postfix_str(", ".join(filter(None, parts)), refresh=False)
        if episode.number % LINE_EVERY == 0:
            mean = sum(returns[-LINE_EVERY:]) / LINE_EVERY
            self.say(
                f"Episode {episode.number:4d} | Reward: {episode.total_reward:3.0f} | "
                f"Avg({LINE_EVERY}): {mean:6.1f} | {note or speed}"
            )

    def _advance(self, done: int) -> None:
        if self._bar is not None:
            self._bar.update(done - self._bar.n)

    def say(self, text: str) -> None:
        """Prints a line above the bar."""
        self._told = self._clock()
        if self._bar is not None:
            self._bar.write(text, file=self._stream)
        else:
            tell(text, self._stream)

    def close(self) -> None:
        """Closes the bar at its present position."""
        if self._bar is not None:
            self._bar.close()
