"""The figures of a training: every row in a CSV file, and the same in TensorBoard.

The CSV is the record. When a training is resumed, the CSV is cut back to where the checkpoint
was written, and TensorBoard's file is written anew from it: so neither has a row twice.
"""

import os
import time
from pathlib import Path

from torch.utils.tensorboard import SummaryWriter

from cartpole.agents.dqn.agent import Learned
from cartpole.errors import CartpoleError
from cartpole.training.dqn_loop import Episode
from cartpole.training.logs import add_table

NAME = "scalars.csv"
HEADER = "step,tag,value,wall_time\n"
EVENTS = "events.out.tfevents.*"


class ScalarLog:
    """Writes points, each with its step, tag and value.

    Args:
        folder: where both files go.
        settings: shown as a table under TEXT.
        length: of the CSV [bytes] at the checkpoint that the training goes on from; 0: a new one.

    Raises:
        OSError: if the disk refuses.
        CartpoleError: if the CSV is shorter than it was at the checkpoint.
    """

    def __init__(self, folder: Path, settings: dict[str, object], length: int = 0) -> None:
        path = folder / NAME
        if length:
            _cut(path, length)
        for old in folder.glob(EVENTS):
            old.unlink()
        self._writer = SummaryWriter(str(folder))
        add_table(self._writer, settings)
        self._file = path.open("a" if length else "w", encoding="utf-8")
        if length:
            self._repeat(path)
        else:
            self._file.write(HEADER)

    def _repeat(self, path: Path) -> None:
        with path.open(encoding="utf-8") as rows:
            next(rows)
            for row in rows:
                step, tag, value, wall_time = row.rstrip("\n").split(",")
                self._writer.add_scalar(tag, float(value), int(step), float(wall_time))

    def add(self, step: int, values: dict[str, float]) -> None:
        """Writes one row for each tag.

        Raises:
            OSError: if the disk refuses.
        """
        now = time.time()
        for tag, value in values.items():
            self._file.write(f"{step},{tag},{float(value)!r},{now:.3f}\n")
            self._writer.add_scalar(tag, value, step, now)

    def sync(self) -> int:
        """Puts the CSV on disk; returns its length [bytes].

        Raises:
            OSError: if the disk refuses.
        """
        self._file.flush()
        os.fsync(self._file.fileno())
        return os.fstat(self._file.fileno()).st_size

    def close(self) -> None:
        """Writes what is still in memory."""
        self._writer.close()
        self._file.close()


class Figures:
    """The observer that writes the field's tags to the log."""

    def __init__(self, log: ScalarLog) -> None:
        self._log = log

    def step_done(self, steps: int) -> None:
        """Nothing to write."""

    def learned(self, steps: int, learned: Learned) -> None:
        """The losses/ tags."""
        values = {"losses/td_loss": learned.td_loss, "losses/q_values": learned.q_values}
        self._log.add(steps, values)

    def episode_done(self, episode: Episode) -> None:
        """The charts/ tags."""
        values = {
            "charts/episodic_return": episode.total_reward,
            "charts/episodic_length": episode.length,
            "charts/SPS": episode.steps_per_second,
            "charts/epsilon": episode.epsilon,
        }
        self._log.add(episode.steps, values)


def _cut(path: Path, length: int) -> None:
    size = path.stat().st_size if path.exists() else 0
    if size < length:
        raise CartpoleError(f"{path} has {size} bytes; at the checkpoint it had {length}")
    os.truncate(path, length)
