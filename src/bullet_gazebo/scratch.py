"""Folders for files that only an engine reads, for a moment; what killed processes left is swept away."""

import contextlib
import fcntl
import functools
import os
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

PREFIX = "bullet_gazebo_scratch_"


@contextlib.contextmanager
def scratch_folder() -> Iterator[Path]:
    """A folder of its own, in the temporary folder, that is gone after the block.

    A process that is killed within the block leaves it. So a living one holds a lock on its folder, which
    ends with the process, and each process removes, at its first folder, those that nobody holds.
    """
    sweep_once()
    path, lock = _make()
    try:
        yield path
    finally:
        shutil.rmtree(path, ignore_errors=True)
        os.close(lock)


def _make() -> tuple[Path, int]:
    while True:  # a sweeper may find the folder before it is locked; then another one is made
        path = Path(tempfile.mkdtemp(prefix=PREFIX))
        try:
            lock = os.open(path, os.O_RDONLY | os.O_DIRECTORY)
        except FileNotFoundError:
            continue
        try:
            fcntl.flock(lock, fcntl.LOCK_EX)
            if _is_at(path, lock):
                return path, lock
        except OSError:  # a file system without locks; nothing is swept there either
            return path, lock
        os.close(lock)


@functools.cache
def sweep_once() -> None:
    """Sweeps, at the first call in this process."""
    sweep(Path(tempfile.gettempdir()))


def sweep(folder: Path) -> None:
    """Removes this user's scratch folders that no living process holds."""
    try:
        names = [name for name in os.listdir(folder) if name.startswith(PREFIX)]
    except OSError:  # then there is nothing of ours
        return
    for name in names:
        with contextlib.suppress(OSError):  # it is somebody's, or gone meanwhile
            _sweep_away(folder / name)


def _sweep_away(path: Path) -> None:
    lock = os.open(path, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        if os.fstat(lock).st_uid == os.getuid() and _is_at(path, lock):
            shutil.rmtree(path)
    finally:
        os.close(lock)


def _is_at(path: Path, opened: int) -> bool:
    """Whether an opened folder still is the one of that path."""
    try:
        return os.path.samestat(os.stat(path, follow_symlinks=False), os.fstat(opened))
    except FileNotFoundError:
        return False
