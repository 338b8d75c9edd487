"""The lock of a folder: one process at a time; the kernel releases it when its holder ends.

Temporary folders are locked, too: so those of killed processes are known.
"""

import fcntl
import functools
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

SCRATCH = ("cartpole_", ".tmp")  # begin and end of a temporary folder's name


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
    """Makes a temporary folder for the block; the first one also removes those of killed processes."""
    place = Path(parent or tempfile.gettempdir())
    _sweep(place)
    with ExitStack() as stack:
        folder = None
        while folder is None:
            made = Path(tempfile.mkdtemp(SCRATCH[1], SCRATCH[0], place))
            with suppress(BlockingIOError, FileNotFoundError):  # another process has just swept it
                stack.enter_context(locked_folder(made))
                folder = made
        stack.callback(shutil.rmtree, folder, ignore_errors=True)
        yield folder


@functools.cache
def _sweep(place: Path) -> None:
    """Removes the temporary folders that no process holds, known by the form of `mkdtemp`'s names."""
    for folder in place.glob(("[a-z0-9_]" * 8).join(SCRATCH)):
        with suppress(OSError), locked_folder(folder):
            shutil.rmtree(folder, ignore_errors=True)
