"""The table of a training as it grows: a CSV file of the columns step, tag, value, wall_time."""

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

from files.content import NotAFile, open_file

NAME = "scalars.csv"  # in a run folder
HEADER = b"step,tag,value,wall_time\n"
CHUNK = 2**21  # [bytes] of one look: a fraction of a second's work
REMEMBERED = 160  # [bytes] that tell whether a file is still the one that was read

Point = tuple[float, str, float]  # step, tag, value


@dataclass(frozen=True)
class Look:
    """What a look at the table has brought."""

    points: list[Point] = field(default_factory=list)
    began_anew: bool = False  # earlier points don't count any more
    is_behind: bool = False  # there is more to read at once
    problem: str = ""  # why there is nothing, in some words


class GrowingTable:
    """Follows a table that somebody else appends to, cuts back, removes or begins anew.

    Args:
        place: the file, or a run folder that has it or will.
    """

    def __init__(self, place: Path) -> None:
        self._place = place
        self._offset = 0  # [bytes] that were read
        self._last = b""  # of these

    @property
    def place(self) -> Path:
        """The file or folder that it was made for."""
        return self._place

    def look(self) -> Look:
        """Returns what has come since the last look; whole lines only."""
        try:
            path = self._place / NAME if self._place.is_dir() else self._place
            with open_file(path) as file:
                began_anew = bool(self._offset) and not self._is_continued(file)
                if began_anew:
                    self._offset, self._last = 0, b""
                file.seek(self._offset)
                content = file.read(CHUNK)
        except (FileNotFoundError, NotADirectoryError):
            return Look(problem="the table is gone" if self._offset else "nothing is written yet")
        except NotAFile:
            return Look(problem="that is no table")
        except (OSError, ValueError) as error:  # the latter of a name with a null character
            return Look(problem=f"it can't be read: {getattr(error, 'strerror', None) or error}")
        return self._taken(content, began_anew)

    def _is_continued(self, file: BinaryIO) -> bool:
        """Whether what was read still stands there."""
        file.seek(self._offset - len(self._last))
        return file.read(len(self._last)) == self._last

    def _taken(self, content: bytes, began_anew: bool) -> Look:
        whole = content[: content.rfind(b"\n") + 1]
        lines = whole.splitlines()
        if not self._offset and not HEADER.startswith(content[: len(HEADER)]):
            return Look(began_anew=began_anew, problem="that is no table of a training")
        if not whole and len(content) == CHUNK:
            return Look(began_anew=began_anew, problem="that is no table of a training")
        if not self._offset:
            lines = lines[1:]
        self._offset += len(whole)
        self._last = (self._last + whole)[-REMEMBERED:]
        points = [point for point in map(_point, lines) if point is not None]
        return Look(points, began_anew, is_behind=len(content) == CHUNK)


def _point(line: bytes) -> Point | None:
    """A row; None if it is damaged, or its value isn't finite."""
    try:
        step, tag, value, _ = line.split(b",")
        point = (float(step), tag.decode(), float(value))
    except ValueError:  # also of bytes that are no text
        return None
    return point if math.isfinite(point[0]) and math.isfinite(point[2]) else None
