"""A run's folder on its way between machines: what has changed in it, in pieces, and their taking in.

The same in both directions: home from the node that trains, and to the node where a training goes on.
Wherever it breaks off, what has arrived is a folder that a training can be resumed in: a checkpoint
gets its name only when it is whole, after the rows of the table that it counts on, `last.pt` as the last.
"""

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, NamedTuple

from rl_workbench.training.checkpoints import BEST, LAST, give_name
from rl_workbench.training.scalar_log import EVENTS
from rl_workbench.training.scalar_log import NAME as SCALARS

PIECE = 4 * 2**20  # [bytes], at most
TAIL = 256  # [bytes] before where a file grew, by which it is seen to be the same one
LOG = ".log"  # what the training said; no file of a folder has this name


class Piece(NamedTuple):
    """A part of a file's content."""

    name: str  # relative to the run's folder
    offset: int
    content: bytes
    grows: bool  # else a whole file, that replaces the one before with its last piece
    is_last: bool


class SecondName(NamedTuple):
    """A further name for a file that was sent."""

    of: str
    name: str


class Gone(NamedTuple):
    """A file that was removed."""

    name: str


Parcel = Piece | SecondName | Gone
_Version = tuple[int, int, int]  # inode, time of the last change [ns], size


class Outbox:
    """Tells what has changed in a folder.

    Args:
        folder: the run's.
        log: what its training says; None: it isn't told.
    """

    def __init__(self, folder: Path, log: Path | None) -> None:
        self._folder, self._log = folder, log
        self._sent: dict[str, _Version] = {}
        self._grown: dict[str, bytes] = {}  # the last bytes sent of files that grow
        self._lengths: dict[str, int] = {}

    def has_new_files(self) -> bool:
        """Whether there is a checkpoint, or another whole file, that wasn't sent yet."""
        return any(
            not _grows(name) and self._sent.get(name) != _version(path.stat())
            for name, path in self._files()
            if path.exists()
        )

    def pack(self) -> Iterator[Parcel]:
        """All that has changed since the last time."""
        with contextlib.ExitStack() as opened:
            whole = self._changed(opened)
            names = {name for name, _ in self._files()}
            growing = [(name, path) for name, path in self._files() if _grows(name)]
            for name, path in [*growing, *([(LOG, self._log)] if self._log else [])]:
                yield from self._growth(name, path)
            yield from self._whole(whole)
        for name in [each for each in {**self._sent, **self._lengths} if each not in names | {LOG}]:
            self._forget(name)
            yield Gone(name)

    def _files(self) -> list[tuple[str, Path]]:
        """All but those that are being written; `last.pt` is the last, before it `best.pt`."""
        found = [
            (path.relative_to(self._folder).as_posix(), path)
            for path in self._folder.rglob("*")
            if not path.name.startswith(".") and path.is_file()
        ]
        return sorted(found, key=lambda each: (each[0] == LAST, each[0] == BEST, each[0]))

    def _changed(self, opened: contextlib.ExitStack) -> list[tuple[str, BinaryIO, _Version]]:
        """Held open, they stay what they are, whatever is put in their place meanwhile."""
        result: list[tuple[str, BinaryIO, _Version]] = []
        for name, path in self._files():
            if _grows(name):
                continue
            with contextlib.suppress(FileNotFoundError):
                file = opened.enter_context(path.open("rb"))
                version = _version(os.fstat(file.fileno()))
                if self._sent.get(name) != version:
                    result.append((name, file, version))
        return result

    def _whole(self, changed: list[tuple[str, BinaryIO, _Version]]) -> Iterator[Parcel]:
        for name, file, version in changed:
            first = next((each for each, its in self._sent.items() if its == version), "")
            if first:
                yield SecondName(first, name)
            else:
                yield from _pieces(name, file, 0, version[2], grows=False)
            self._sent[name] = version

    def _growth(self, name: str, path: Path) -> Iterator[Piece]:
        with contextlib.suppress(FileNotFoundError), path.open("rb") as file:
            begin, tail = self._lengths.get(name, 0), self._grown.get(name, b"")
            length = os.fstat(file.fileno()).st_size
            file.seek(begin - len(tail))
            is_same = file.read(len(tail)) == tail
            if is_same and length == begin and name in self._lengths:
                return
            if is_same:
                yield from _pieces(name, file, begin, length, grows=True)
            else:  # it was cut back, and has grown otherwise: replaced as a whole, it is never too short
                yield from _pieces(name, file, 0, length, grows=False)
            file.seek(max(0, length - TAIL))
            self._grown[name] = file.read(length - file.tell())
            self._lengths[name] = length

    def _forget(self, name: str) -> None:
        self._sent.pop(name, None)
        self._grown.pop(name, None)
        self._lengths.pop(name, None)


class Inbox:
    """Takes in what an Outbox tells.

    Args:
        folder: the run's, here; it is made with the first file.
        log: to which is added what the training says.
    """

    def __init__(self, folder: Path, log: Path) -> None:
        self._folder, self._log = folder, log
        self._log_began = log.stat().st_size if log.exists() else 0

    def take(self, parcel: Parcel) -> None:
        """Takes in one.

        Raises:
            OSError: if the disk refuses.
        """
        if isinstance(parcel, Piece):
            self._write(parcel)
        elif isinstance(parcel, SecondName):
            give_name(self._folder / parcel.of, self._folder / parcel.name)
        else:
            (self._folder / parcel.name).unlink(missing_ok=True)

    def _write(self, piece: Piece) -> None:
        path, offset = self._folder / piece.name, piece.offset
        if piece.name == LOG:
            path, offset = self._log, self._log_began + piece.offset
        path.parent.mkdir(parents=True, exist_ok=True)
        if piece.grows:
            _put(path, offset, piece.content)
            return
        temporary = path.with_name(f".{path.name}.carried")
        _put(temporary, offset, piece.content)
        if piece.is_last:
            with temporary.open("rb") as file:
                os.fsync(file.fileno())
            temporary.replace(path)


def _grows(name: str) -> bool:
    return name == SCALARS or name.startswith(EVENTS)


def _version(status: os.stat_result) -> _Version:
    return status.st_ino, status.st_mtime_ns, status.st_size


def _pieces(name: str, file: BinaryIO, begin: int, end: int, grows: bool) -> Iterator[Piece]:
    """At least one, also of an empty file."""
    file.seek(begin)
    while True:
        content = file.read(min(PIECE, end - begin))
        is_last = begin + len(content) >= end or not content
        yield Piece(name, begin, content, grows, is_last)
        begin += len(content)
        if is_last:
            return


def _put(path: Path, offset: int, content: bytes) -> None:
    """Writes at a place, behind which nothing is left."""
    with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT, 0o666), "wb") as file:
        file.truncate(offset)
        file.seek(offset)
        file.write(content)
