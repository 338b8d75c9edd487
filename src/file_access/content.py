"""Reading a file of unknown origin: only regular files, and within a bound of bytes."""

import errno
import io
import os
import stat
from pathlib import Path
from typing import BinaryIO

from file_access.text import one_line

MAX_BYTES = 64 * 2**20  # of one file or text; robots have some hundred kilobytes, worlds megabytes


class FileError(ValueError):
    """A file or text can't be read; the message is one line."""

    def __init__(self, text: str) -> None:
        super().__init__(one_line(text))


class TooLarge(FileError):
    """A file or text exceeds a limit of its reader."""


class NotAFile(OSError):
    """The path is a folder, pipe, socket or device."""

    def __init__(self, path: Path) -> None:
        super().__init__(errno.EINVAL, "it is not a file", str(path))


def open_file(path: Path) -> BinaryIO:
    """Opens a regular file; raises NotAFile for a pipe or device, which could block forever, or OSError."""
    if not stat.S_ISREG(path.stat().st_mode):
        raise NotAFile(path)
    # Some files of the kernel block until there is news.
    return os.fdopen(os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC), "rb")


def open_text(path: Path) -> io.TextIOWrapper:
    """Opens a regular file of UTF-8 text like `open_file`, without translating line ends."""
    return io.TextIOWrapper(open_file(path), encoding="utf-8", newline="")


def read_file(path: Path, most: int = MAX_BYTES) -> bytes:
    """Returns the content of a regular file; raises TooLarge beyond `most` bytes, or FileError."""
    try:
        with open_file(path) as file:
            data = file.read(most + 1)  # some files of the kernel have no end
    except NotAFile as error:
        raise FileError(str(error.strerror)) from error
    except OSError as error:
        raise FileError(f"it can't be read: {error.strerror}") from error
    except ValueError as error:  # a name with a null character
        raise FileError(f"it can't be read: {error}") from error
    if len(data) > most:
        raise TooLarge(f"it has more than {most} bytes (MAX_BYTES)")
    return data
