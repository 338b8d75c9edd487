"""Network weights on disk: plain state_dicts, each file whole or absent."""

import io
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, BinaryIO

import torch


def write_atomically(path: Path, write: Callable[[BinaryIO], object]) -> None:
    """Lets `write` fill a file that replaces `path` only once it is whole and on disk.

    Raises:
        OSError: if the disk refuses; an older file of that name is untouched.
    """
    descriptor, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(descriptor, "wb") as stream:
            write(stream)
            stream.flush()
            os.fsync(stream.fileno())
        os.chmod(temporary, 0o666 & ~_umask())
        os.replace(temporary, path)
    except BaseException:
        os.unlink(temporary)
        raise
    _sync_folder(path.parent)


def save_tensors(path: Path, content: dict[str, Any]) -> None:
    """Writes what `torch.load` reads, whole or not at all.

    By way of the memory: torch turns the error of a full disk into one of its own.

    Raises:
        OSError: if the disk refuses; an older file of that name is untouched.
    """
    memory = io.BytesIO()
    torch.save(content, memory)
    write_atomically(path, lambda stream: stream.write(memory.getbuffer()))


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def _sync_folder(folder: Path) -> None:
    """Makes a rename survive a power cut."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
