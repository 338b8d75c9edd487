"""The content of a file, if it is one."""

import os
import stat
from pathlib import Path

from file_reading.errors import FileError, TooLarge

MAX_BYTES = 64 * 2**20  # of one file or text; robots have some hundred kilobytes, worlds megabytes


def read_file(path: Path, most: int = MAX_BYTES) -> bytes:
    """Returns the content of a regular file of at most `most` bytes.

    A pipe or device, which could keep its reader for ever, is not even opened.

    Raises:
        FileError: if it can't be read, or is no file.
        TooLarge: if it is larger.
    """
    try:
        regular = stat.S_ISREG(path.stat().st_mode)
        data = _read(path, most + 1) if regular else b""
    except OSError as error:
        raise FileError(f"it can't be read: {error.strerror}") from error
    except ValueError as error:  # a name with a null character
        raise FileError(f"it can't be read: {error}") from error
    if not regular:
        raise FileError("it is not a file")
    if len(data) > most:
        raise TooLarge(f"it has more than {most} bytes (MAX_BYTES)")
    return data


def _read(path: Path, most: int) -> bytes:
    """Some files of the kernel's wait for news, and some have no end."""
    with os.fdopen(os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC), "rb") as file:
        return file.read(most)
