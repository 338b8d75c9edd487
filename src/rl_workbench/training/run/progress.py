"""What the user sees while training: a bar on a terminal, else a line every 20 episodes."""

import os
import sys
from typing import TextIO

from tqdm import tqdm

from rl_workbench.training.pg.loop import EpisodeRecord

LINE_EVERY = 20  # [episodes]
WIDTH = 100  # [columns] of the bar on a terminal that doesn't tell its size


def _has_size(stream: TextIO) -> bool:
    """Whether the terminal tells its size: tqdm would draw a bar of no width on one that doesn't."""
    try:
        return os.get_terminal_size(stream.fileno()).columns > 0
    except (OSError, ValueError):
        return False


def terminal_bar(total: int, unit: str, stream: TextIO, done: int = 0) -> tqdm:
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


class Bar:
    """A tqdm bar with the last return, the last length and the steps per second."""

    def __init__(self, episodes: int, stream: TextIO, done: int = 0) -> None:
        self._bar = terminal_bar(episodes, "episode", stream, done)

    def episode_done(self, record: EpisodeRecord) -> None:
        self._bar.set_postfix_str(
            f"return {record.total_reward:.0f}, length {record.length}, "
            f"{record.steps_per_second:.0f} steps/s",
            refresh=False,
        )
        self._bar.update()

    def close(self) -> None:
        self._bar.close()


class Lines:
    """Means over the last 20 episodes, one line for each 20."""

    def __init__(self, episodes: int, stream: TextIO) -> None:
        self._episodes = episodes
        self._stream = stream
        self._recent: list[EpisodeRecord] = []

    def episode_done(self, record: EpisodeRecord) -> None:
        self._recent.append(record)
        if (record.index + 1) % LINE_EVERY == 0:
            self._print()
            self._recent.clear()

    def _print(self) -> None:
        count = len(self._recent)
        length = sum(record.length for record in self._recent) / count
        total = sum(record.total_reward for record in self._recent) / count
        last = self._recent[-1]
        print(
            f"episode {last.index + 1:5d}/{self._episodes}  mean length {length:7.1f}  "
            f"mean return {total:8.1f}  {last.steps_per_second:6.0f} steps/s",
            file=self._stream,
            flush=True,
        )

    def close(self) -> None:
        """Nothing to close."""


def progress(episodes: int, stream: TextIO | None = None, done: int = 0) -> Bar | Lines:
    """The form that suits where the output goes (standard error unless told otherwise)."""
    stream = stream or sys.stderr
    return Bar(episodes, stream, done) if stream.isatty() else Lines(episodes, stream)
