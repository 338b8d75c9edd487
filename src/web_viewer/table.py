"""The scalars of a training as they are written: a CSV file with the columns step, tag, value, wall_time."""

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

from file_access.content import NotAFile, open_file

NAME = "scalars.csv"  # in a run folder
HEADER = b"step,tag,value,wall_time\n"
CHUNK = 2**21  # [bytes] of one read: a fraction of a second's work
REMEMBERED = 160  # [bytes] by which a file is recognised as the one that was read before

ScalarPoint = tuple[float, str, float]  # step, tag, value


@dataclass(frozen=True)
class TableUpdate:
    """The result of one read."""

    points: list[ScalarPoint] = field(default_factory=list)
    restarted: bool = False  # the file is another one now: forget earlier points
    has_more: bool = False  # there is more to read at once
    problem: str = ""  # why nothing can be read


class GrowingTable:
    """Follows a table that another process appends to, truncates, removes or starts over.

    Args:
        path: The file, or a run folder that has it or will have it.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._offset = 0  # [bytes] read so far
        self._last = b""  # the last of these

    def read(self) -> TableUpdate:
        """Returns the whole lines that were written since the last call."""
        try:
            path = self.path / NAME if self.path.is_dir() else self.path
            with open_file(path) as file:
                restarted = bool(self._offset) and not self._is_same(file)
                if restarted:
                    self._offset, self._last = 0, b""
                file.seek(self._offset)
                content = file.read(CHUNK)
        except (FileNotFoundError, NotADirectoryError):
            gone = "the table is gone" if self._offset else "nothing is written yet"
            return TableUpdate(problem=gone)
        except NotAFile:
            return TableUpdate(problem="this is not a file")
        except (OSError, ValueError) as error:  # ValueError: a null character in the name
            reason = getattr(error, "strerror", None) or error
            return TableUpdate(problem=f"can't read the table: {reason}")
        return self._parse(content, restarted)

    def _is_same(self, file: BinaryIO) -> bool:
        file.seek(self._offset - len(self._last))
        return file.read(len(self._last)) == self._last

    def _parse(self, content: bytes, restarted: bool) -> TableUpdate:
        whole = content[: content.rfind(b"\n") + 1]
        is_foreign = not self._offset and not HEADER.startswith(content[: len(HEADER)])
        if is_foreign or (not whole and len(content) == CHUNK):
            return TableUpdate(restarted=restarted, problem="this is not a training's table")
        lines = whole.splitlines()[0 if self._offset else 1 :]
        self._offset += len(whole)
        self._last = (self._last + whole)[-REMEMBERED:]
        points = [point for point in map(_parse_row, lines) if point is not None]
        return TableUpdate(points, restarted, has_more=len(content) == CHUNK)


def _parse_row(line: bytes) -> ScalarPoint | None:
    """Returns None for a damaged row and for a value that isn't finite."""
    try:
        step, tag, value, _ = line.split(b",")
        point = (float(step), tag.decode(), float(value))
    except ValueError:  # also of bytes that aren't UTF-8
        return None
    return point if math.isfinite(point[0]) and math.isfinite(point[2]) else None
