"""Locks between processes, on a folder; the kernel releases them when their process ends."""

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
        fcntl.flock(descriptor, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
        # Its last holder may have removed it, and somebody else made another one, while we waited.
        if not os.path.samestat(os.fstat(descriptor), os.stat(folder)):
            raise FileNotFoundError(f"{folder} was replaced just now")
        yield
    finally:
        os.close(descriptor)


def is_locked(folder: Path) -> bool:
    """Returns whether somebody holds the lock of an existing folder.

    It takes a shared lock for a moment, so it may refuse somebody who doesn't wait: call it seldom.
    """
    try:
        descriptor = os.open(folder, os.O_RDONLY | os.O_CLOEXEC)
    except OSError:
        return False
    try:
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    finally:
        os.close(descriptor)
    return False
