"""The lock of a folder: one process at a time; the kernel releases it when its holder ends."""

import fcntl
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def locked_folder(folder: Path) -> Iterator[None]:
    """Holds the lock of an existing folder for the block.

    Raises BlockingIOError if another holder has it, even in this process; FileNotFoundError if there is no
    such folder, also if its last holder has just removed it; or another OSError.
    """
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        if not os.path.samestat(os.fstat(descriptor), os.stat(folder)):
            raise FileNotFoundError(f"{folder} was replaced just now")
        yield
    finally:
        os.close(descriptor)


def is_locked(folder: Path) -> bool:
    """Returns whether an existing folder's lock is held, by a shared one for a moment: call it seldom."""
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


@contextmanager
def scratch_folder(parent: str | None = None) -> Iterator[Path]:
    """Makes a temporary folder for the block."""
    with tempfile.TemporaryDirectory(prefix="cartpole_", dir=parent, ignore_cleanup_errors=True) as name:
        yield Path(name)
