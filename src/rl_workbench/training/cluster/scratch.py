"""Folders for a while: each goes with its block, and what killed processes left goes with the next one."""

import contextlib
import fcntl
import os
import shutil
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

ABANDONED_AFTER = 60.0  # [s] since something was made in it, if nobody holds it


@contextlib.contextmanager
def scratch_folder(purpose: str, place: str = "") -> Iterator[Path]:
    """A new folder, of this machine and user alone.

    Args:
        purpose: the beginning of its name, of all that are for the same.
        place: where it is made; among the temporary files unless told otherwise.
    """
    place = place or tempfile.gettempdir()
    prefix = f"{purpose}_{os.getuid()}_"
    for left in Path(place).glob(f"{prefix}*"):
        _remove_abandoned(left)
    with tempfile.TemporaryDirectory(prefix=prefix, dir=place, ignore_cleanup_errors=True) as name:
        descriptor = os.open(name, os.O_RDONLY)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX)
            yield Path(name)
        finally:
            os.close(descriptor)


def _remove_abandoned(folder: Path) -> None:
    """Removes it if nobody holds it; one that was only just made will be held in a moment."""
    with contextlib.suppress(OSError):  # another's, or gone meanwhile
        descriptor = os.open(folder, os.O_RDONLY | os.O_NOFOLLOW)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            status = os.fstat(descriptor)
            if status.st_uid == os.getuid() and time.time() - status.st_mtime > ABANDONED_AFTER:
                shutil.rmtree(folder)
        finally:
            os.close(descriptor)
