"""Small file systems that fill up and can grow."""

from __future__ import annotations

import contextlib
import subprocess
from collections.abc import Iterator
from pathlib import Path


class SmallDisk:
    """A file system in memory that holds so much, at `folder`; for root."""

    def __init__(self, folder: Path, size: int) -> None:
        self.folder = folder
        folder.mkdir(parents=True)
        _run("mount", "-t", "tmpfs", "-o", f"size={size},mode=0755", "stress", folder)

    def grow(self, size: int) -> None:
        """Has room for so many bytes."""
        _run("mount", "-o", f"remount,size={size}", self.folder)

    def close(self) -> None:
        """It is gone with all that it held."""
        _run("umount", "--lazy", self.folder)


def _run(*command: object) -> None:
    subprocess.run([str(word) for word in command], check=True, capture_output=True)


@contextlib.contextmanager
def small_disk(folder: Path, size: int) -> Iterator[SmallDisk]:
    """One for the length of a block."""
    disk = SmallDisk(folder, size)
    try:
        yield disk
    finally:
        disk.close()


def can_mount(folder: Path) -> bool:
    """Whether this process may make such disks."""
    try:
        with small_disk(folder, 65536):
            return True
    except (OSError, subprocess.CalledProcessError):
        return False
