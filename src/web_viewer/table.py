"""The scalars of a training as they are written: a CSV file with the columns step, tag, value, wall_time."""

import math
from pathlib import Path
from typing import NamedTuple

from file_access.content import open_file

NAME = "scalars.csv"  # in a run folder
HEADER = b"step,tag,value,wall_time\n"
CHUNK = 2**21  # [bytes] of one read: a fraction of a second's work
REMEMBERED = 160  # [bytes] by which a file is recognised as the one that was read before

ScalarPoint = tuple[float, str, float]  # step, tag, value


class TableUpdate(NamedTuple):
    """The result of one read."""

    points: list[ScalarPoint]
    has_more: bool  # there is more to read at once


class GrowingTable:
    """Follows the table of a run folder that another process appends to, truncates or removes."""

    def __init__(self, folder: Path) -> None:
        self._path = folder / NAME
        self._offset = 0  # [bytes] read so far
        self._last = b""  # the last of these

    def read(self) -> TableUpdate:
        """Returns the whole lines that were written since the last call; all, if it is another file now."""
        try:
            with open_file(self._path) as file:
                file.seek(self._offset - len(self._last))
                if file.read(len(self._last)) != self._last:
                    self._offset, self._last = 0, b""
                file.seek(self._offset)
                content = file.read(CHUNK)
        except OSError:
            return TableUpdate([], has_more=False)
        whole = content[: content.rfind(b"\n") + 1]
        self._offset += len(whole)
        self._last = (self._last + whole)[-REMEMBERED:]
        points = [point for point in map(_parse_row, whole.splitlines()) if point is not None]
        return TableUpdate(points, has_more=bool(whole) and len(content) == CHUNK)


def _parse_row(line: bytes) -> ScalarPoint | None:
    """Returns None for the header, a damaged row, and a value that isn't finite."""
    try:
        step, tag, value, _ = line.split(b",")
        point = (float(step), tag.decode(), float(value))
    except ValueError:  # also of bytes that aren't UTF-8
        return None
    return point if math.isfinite(point[0]) and math.isfinite(point[2]) else None
