"""The figures of a training: every row in a CSV file, and the same in TensorBoard.

The CSV is the record. When a training is resumed, the CSV is truncated to where the checkpoint was written,
and TensorBoard's file is rewritten from it. So neither has duplicate rows.
"""

import contextlib
import os
import socket
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from file_access.content import open_file

SCALARS = "scalars.csv"  # in a run folder
HEADER = b"step,tag,value,wall_time\n"
# Tags, as CleanRL and Stable-Baselines3 name them.
RETURN, EVALUATION = "charts/episodic_return", "eval/mean_reward"
CONFIRMED = "eval/confirmed_reward"  # of a policy that became the best one
SUCCESS, EVAL_SUCCESS = "rollout/success_rate", "eval/success_rate"  # from 0 to 1
EVENTS = "events.out.tfevents."
VERSION = "brain.Event:2"  # of TensorBoard's format, in the first record of its files
SHOWN_AFTER = 10.0  # [s], longest time until TensorBoard can see a point
READ_AFTER = 1.0  # [s], longest time until a reader of the CSV can see a row, if others follow
METRICS = (EVALUATION, RETURN)  # next to the settings, under HPARAMS

Point = tuple[str, float, int, float]  # tag, value, step, wall time [s]


class ScalarLog:
    """Writes points, each with its step, tag and value, into both files.

    Settings are a table under TEXT, and under HPARAMS next to those of other trainings. `length` is the CSV's
    [bytes] at the checkpoint to continue from; 0 starts a new one. `say` is called if the CSV lacks rows.
    """

    def __init__(
        self, folder: Path, settings: dict[str, object], length: int = 0, say: Callable[[str], None] = print
    ) -> None:
        path = folder / SCALARS
        points = _truncated(path, length, say) if length else []
        if not points:
            path.write_bytes(HEADER)
        self._file = path.open("a", encoding="utf-8")
        self._flushed = time.monotonic()
        for old in folder.glob(f"{EVENTS}*"):
            old.unlink()
        self._events = EventFile(folder)
        self._events.add_settings(settings)
        for tag, value, step, wall_time in points:
            self._events.add_scalar(tag, value, step, wall_time)

    def add(self, step: int, values: Mapping[str, float]) -> None:
        """Writes one row for each tag."""
        now = time.time()
        for tag, value in values.items():
            self._file.write(f"{step},{tag},{float(value)!r},{now:.3f}\n")
            self._events.add_scalar(tag, value, step, now)
        if time.monotonic() - self._flushed > READ_AFTER:
            self._flushed = time.monotonic()
            self._file.flush()

    def sync(self) -> int:
        """Puts the CSV on disk; returns its length [bytes]."""
        self._events.file.flush()
        self._file.flush()
        os.fsync(self._file.fileno())
        return os.fstat(self._file.fileno()).st_size

    def close(self) -> None:
        """Flushes and closes both files."""
        try:
            self._events.file.close()
        finally:
            self._file.close()


class EventFile:
    """TensorBoard's file, written by the thread that calls.

    TensorBoard's own writer has a thread of its own, which a full disk ends with a traceback.
    """

    def __init__(self, folder: Path) -> None:
        # Slow to import, and many who import this module want the names of tags only.
        from tensorboard.compat.proto.event_pb2 import Event
        from tensorboard.summary.writer.record_writer import RecordWriter
        from torch.utils.tensorboard import summary

        self._event, self._summary = Event, summary
        self._shown, now = time.monotonic(), time.time()
        path = folder / f"{EVENTS}{now:.0f}.{socket.gethostname()}.{os.getpid()}"
        self.file = path.open("wb")
        self._records = RecordWriter(self.file)
        self._write(Event(wall_time=now, file_version=VERSION))

    def add_scalar(self, tag: str, value: float, step: int, wall_time: float) -> None:
        """Writes a point."""
        self._add(self._summary.scalar(tag, value), step, wall_time)

    def add_settings(self, settings: dict[str, object]) -> None:
        """Writes settings as a table under TEXT, and as columns under HPARAMS."""
        rows = "\n".join(f"|{name}|{value}|" for name, value in settings.items())
        table = _utf8(f"|parameter|value|\n|-|-|\n{rows}")
        self._add(self._summary.text("hyperparameters", table))
        plain = {
            name: value if type(value) in (int, float) else _utf8(str(value))  # True would become 1
            for name, value in settings.items()
        }
        for summary in self._summary.hparams(plain, dict.fromkeys(METRICS, 0.0)):
            self._add(summary)

    def _add(self, summary: Any, step: int = 0, wall_time: float | None = None) -> None:
        self._write(self._event(wall_time=wall_time or time.time(), step=step, summary=summary))
        if time.monotonic() - self._shown > SHOWN_AFTER:
            self._shown = time.monotonic()
            self.file.flush()

    def _write(self, event: Any) -> None:
        self._records.write(event.SerializeToString())


def _truncated(path: Path, length: int, say: Callable[[str], None]) -> list[Point]:
    """Truncates the CSV to a length [bytes], or to its last complete row before; returns its points."""
    content = b""
    with contextlib.suppress(FileNotFoundError), open_file(path) as file:
        content = file.read(length)
    points: list[Point] = []
    complete = len(HEADER) if content.startswith(HEADER) else 0
    for row in content[complete:].splitlines(keepends=True) if complete else []:
        try:
            step, tag, value, wall_time = row.decode().split(",")
            point = (tag, float(value), int(step), float(wall_time))
        except ValueError:  # also for bytes that aren't text
            break
        if not row.endswith(b"\n"):
            break
        points.append(point)
        complete += len(row)
    if complete < length:
        say(f"{path} lacks rows that it had at the checkpoint; continuing without them")
    if content:
        os.truncate(path, complete)
    return points


def _utf8(text: str) -> str:
    """Returns a text with backslash escapes for what UTF-8 can't encode, such as a path's odd bytes."""
    return text.encode("utf-8", "backslashreplace").decode()
