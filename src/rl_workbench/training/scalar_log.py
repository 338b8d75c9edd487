"""The figures of a training: every row in a CSV file, and the same in TensorBoard.

The CSV is the record. When a training is resumed, the CSV is cut back to where the checkpoint
was written, and TensorBoard's file is written anew from it: so neither has a row twice.
"""

import contextlib
import os
import socket
import time
from collections.abc import Callable
from pathlib import Path

from tensorboard.compat.proto.event_pb2 import Event
from tensorboard.compat.proto.summary_pb2 import Summary
from tensorboard.summary.writer.record_writer import RecordWriter
from torch.utils.tensorboard.summary import hparams, scalar, text

from files.content import open_file

NAME = "scalars.csv"
# Tags, as CleanRL and Stable-Baselines3 name them.
RETURN, EVALUATION = "charts/episodic_return", "eval/mean_reward"
CONFIRMED = "eval/confirmed_reward"  # of a policy that became the best one
SUCCESS, EVAL_SUCCESS = "rollout/success_rate", "eval/success_rate"  # from 0 to 1
HEADER = "step,tag,value,wall_time\n"
EVENTS = "events.out.tfevents."
VERSION = "brain.Event:2"  # of the file, as TensorBoard asks for in its first record
SHOWN_AFTER = 10.0  # [s] at most until TensorBoard can see a point
READ_AFTER = 1.0  # [s] at most until who follows the CSV can see a row, if others come
METRICS = (EVALUATION, RETURN)  # beside the settings, under HPARAMS

Point = tuple[str, float, int, float]  # tag, value, step, wall time [s]


class ScalarLog:
    """Writes points, each with its step, tag and value.

    Args:
        folder: where both files go.
        settings: shown as a table under TEXT, and under HPARAMS beside those of other trainings.
        length: of the CSV [bytes] at the checkpoint that the training goes on from; 0: a new one.
        say: is told if the CSV has lost rows since then; the training doesn't depend on them.

    Raises:
        OSError: if the disk refuses.
    """

    def __init__(
        self,
        folder: Path,
        settings: dict[str, object],
        length: int = 0,
        say: Callable[[str], None] = print,
    ) -> None:
        path = folder / NAME
        points = _cut(path, length, say) if length else []
        if not points:
            path.write_text(HEADER, encoding="utf-8")
        self._file = path.open("a", encoding="utf-8")
        self._given = time.monotonic()
        for old in folder.glob(f"{EVENTS}*"):
            old.unlink()
        self._events = EventFile(folder)
        _add_settings(self._events, settings)
        for tag, value, step, wall_time in points:
            self._events.add(scalar(tag, value), step, wall_time)

    def add(self, step: int, values: dict[str, float]) -> None:
        """Writes one row for each tag.

        Raises:
            OSError: if the disk refuses.
        """
        now = time.time()
        for tag, value in values.items():
            self._file.write(f"{step},{tag},{float(value)!r},{now:.3f}\n")
            self._events.add(scalar(tag, value), step, now)
        if time.monotonic() - self._given > READ_AFTER:
            self._given = time.monotonic()
            self._file.flush()

    def sync(self) -> int:
        """Puts the CSV on disk; returns its length [bytes].

        Raises:
            OSError: if the disk refuses.
        """
        self._events.flush()
        self._file.flush()
        os.fsync(self._file.fileno())
        return os.fstat(self._file.fileno()).st_size

    def close(self) -> None:
        """Writes what is still in memory.

        Raises:
            OSError: if the disk refuses.
        """
        try:
            self._events.close()
        finally:
            self._file.close()


class EventFile:
    """TensorBoard's file, written by who calls.

    TensorBoard's own writer has a thread, which a full disk ends in a traceback.

    Args:
        folder: where it is made, under a name of its own.

    Raises:
        OSError: if the disk refuses, as each method does.
    """

    def __init__(self, folder: Path) -> None:
        self._shown, now = time.monotonic(), time.time()
        path = folder / f"{EVENTS}{now:.0f}.{socket.gethostname()}.{os.getpid()}"
        self._file = path.open("wb")
        self._records = RecordWriter(self._file)
        self._write(Event(wall_time=now, file_version=VERSION))

    def add(self, summary: Summary, step: int = 0, wall_time: float | None = None) -> None:
        """Writes what TensorBoard is to show."""
        self._write(Event(wall_time=wall_time or time.time(), step=step, summary=summary))
        if time.monotonic() - self._shown > SHOWN_AFTER:
            self._shown = time.monotonic()
            self.flush()

    def _write(self, event: Event) -> None:
        self._records.write(event.SerializeToString())

    def flush(self) -> None:
        """Gives what was added to the disk."""
        self._file.flush()

    def close(self) -> None:
        """The same, and nothing more will be added."""
        self._file.close()


def _cut(path: Path, length: int, say: Callable[[str], None]) -> list[Point]:
    """Cuts the CSV back to a length [bytes], or to what is whole of it; returns its points."""
    content = b""
    with contextlib.suppress(FileNotFoundError), open_file(path) as file:
        content = file.read(length)
    header, *rows = content.splitlines(keepends=True) or [b""]
    points, whole = [], len(header)
    for row in rows:
        point = _point(row)
        if point is None:
            break
        points.append(point)
        whole += len(row)
    if header.decode(errors="replace") != HEADER:
        points, whole = [], 0
    if whole < length:
        say(f"{path} lacks rows that it had at the checkpoint; going on without them")
    if content:
        os.truncate(path, whole)
    return points


def _point(row: bytes) -> Point | None:
    """A row of the CSV; None if it isn't one, or not a whole one."""
    try:
        step, tag, value, wall_time = row.decode().split(",")
        return (tag, float(value), int(step), float(wall_time)) if row.endswith(b"\n") else None
    except ValueError:  # also of bytes that are no text
        return None


def _add_settings(events: EventFile, settings: dict[str, object]) -> None:
    """Shows settings as a table under TEXT, and as columns under HPARAMS."""
    rows = "\n".join(f"|{name}|{value}|" for name, value in settings.items())
    events.add(text("hyperparameters", _utf8(f"|parameter|value|\n|-|-|\n{rows}")))
    plain = {
        name: value if type(value) in (int, float) else _utf8(str(value))  # True would become 1
        for name, value in settings.items()
    }
    for summary in hparams(plain, dict.fromkeys(METRICS, 0.0)):
        events.add(summary)


def _utf8(text: str) -> str:
    """`text` with backslashes for what UTF-8 can't say: the bytes of a path that isn't in it."""
    return text.encode("utf-8", "backslashreplace").decode()
