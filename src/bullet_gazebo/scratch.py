"""Temporary folders for files that only an engine reads; those of killed processes are swept away."""

import contextlib
import functools
import os
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

from file_access.locks import locked_folder

PREFIX = "bullet_gazebo_scratch_"


@contextlib.contextmanager
def scratch_folder() -> Iterator[Path]:
    """Makes a temporary folder for the block.

    A process that is killed within the block leaves its folder behind. So each process locks its folders
    while it uses them, and removes all unlocked ones before it makes its first.
    """
    sweep_once()
    with contextlib.ExitStack() as stack:
        path = _make(stack)
        try:
            yield path
        finally:
            shutil.rmtree(path, ignore_errors=True)


def _make(stack: contextlib.ExitStack) -> Path:
    """Returns a new folder, locked until `stack` ends."""
    while True:
        path = Path(tempfile.mkdtemp(prefix=PREFIX))
        try:
            stack.enter_context(locked_folder(path))
        except FileNotFoundError:  # another process has swept it before it was locked
            continue
        except OSError:  # a file system without locks: nothing is swept there
            pass
        return path


@functools.cache
def sweep_once() -> None:
    """Sweeps the temporary folder at the first call in this process."""
    sweep(Path(tempfile.gettempdir()))


def sweep(folder: Path) -> None:
    """Removes this user's scratch folders that no living process holds."""
    try:
        names = [name for name in os.listdir(folder) if name.startswith(PREFIX)]
    except OSError:
        return
    for name in names:
        path = folder / name
        with contextlib.suppress(OSError):  # it is locked, or gone meanwhile
            if path.lstat().st_uid == os.getuid():
                with locked_folder(path, wait=False):
                    shutil.rmtree(path)  # which refuses a link
