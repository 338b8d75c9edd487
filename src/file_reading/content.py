"""The content of a file, if it is one."""

import errno
import io
import os
import stat
from pathlib import Path
from typing import BinaryIO

from file_reading.errors import FileError, TooLarge

MAX_BYTES = 64 * 2**20  # of one file or text; robots have some hundred kilobytes, worlds megabytes


class NotAFile(OSError):
    """A folder, pipe, socket or device."""

    def __init__(self, path: Path) -> None:
        super().__init__(errno.EINVAL, "it is not a file", str(path))


def open_file(path: Path) -> BinaryIO:
    """Opens a regular file to be read.

    A pipe or device, which could keep its reader for ever, is not even opened.

    Raises:
        NotAFile: if it is none.
        OSError: if it can't be read.
    """
    if not stat.S_ISREG(path.stat().st_mode):
        raise NotAFile(path)
    # Some files of the kernel's wait for news.
    return os.fdopen(os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC), "rb")


def open_text(path: Path) -> io.TextIOWrapper:
    """As open_file, for a text in UTF-8, its ends of line as they are."""
    return io.TextIOWrapper(open_file(path), encoding="utf-8", newline="")


def read_file(path: Path, most: int = MAX_BYTES) -> bytes:
    """Returns the content of a regular file of at most `most` bytes.

    Raises:
        FileError: if it can't be read, or is no file.
        TooLarge: if it is larger.
    """
    try:
        with open_file(path) as file:
            data = file.read(most + 1)  # some have no end
    except NotAFile as error:
        raise FileError(str(error.strerror)) from error
    except OSError as error:
        raise FileError(f"it can't be read: {error.strerror}") from error
    except ValueError as error:  # a name with a null character
        raise FileError(f"it can't be read: {error}") from error
    if len(data) > most:
        raise TooLarge(f"it has more than {most} bytes (MAX_BYTES)")
    return data
