"""Locks between processes, on a folder or a file; the kernel releases them when their process ends."""

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def locked_folder(folder: Path, *, wait: bool = True) -> Iterator[None]:
    """Holds the lock of a folder for the block.

    Args:
        folder: an existing folder.
        wait: whether to wait for another holder, be it in this process.

    Raises:
        BlockingIOError: if another one holds it and `wait` is false.
        FileNotFoundError: if there is no such folder, also if its last holder has removed it.
        OSError: if it can't be opened, or its file system has no locks.
    """
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        _lock(descriptor, wait)
        # Its last holder may have removed it, and somebody else made another one, while we waited.
        if not os.path.samestat(os.fstat(descriptor), os.stat(folder)):
            raise FileNotFoundError(f"{folder} was replaced just now")
        yield
    finally:
        os.close(descriptor)


@contextmanager
def locked_file(file: Path, *, wait: bool = True) -> Iterator[None]:
    """Holds the lock of a file for the block; makes the file if it is missing. Nobody may remove it.

    Raises:
        BlockingIOError: if another one holds it and `wait` is false.
        OSError: if it can't be opened, or its file system has no locks.
    """
    descriptor = os.open(file, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
    try:
        _lock(descriptor, wait)
        yield
    finally:
        os.close(descriptor)


def is_locked(path: Path) -> bool:
    """Returns whether somebody holds the lock of an existing folder or file.

    It takes a shared lock for a moment, so it may refuse somebody who doesn't wait: call it seldom.
    """
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
    except OSError:
        return False
    try:
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    finally:
        os.close(descriptor)
    return False


def _lock(descriptor: int, wait: bool) -> None:
    fcntl.flock(descriptor, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
