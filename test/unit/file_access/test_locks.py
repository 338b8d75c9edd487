"""Locks on folders and files: one holder at a time, and none once its process has ended."""

import subprocess
import sys

import pytest

from file_access.locks import is_locked, locked_file, locked_folder

HOLDER = """
import sys
from pathlib import Path
from file_access import locks
with locks.{function}(Path(sys.argv[1])):
    print("locked", flush=True)
    sys.stdin.read()
"""


@pytest.fixture(params=[locked_folder, locked_file])
def lock(request, tmp_path):
    """A function that locks, and the path that it locks."""
    is_folder = request.param is locked_folder
    return request.param, tmp_path if is_folder else tmp_path / "lock"


def test_a_second_holder_is_refused_until_the_block_ends(lock) -> None:
    locked, path = lock
    with locked(path):
        assert is_locked(path)
        with pytest.raises(BlockingIOError), locked(path, wait=False):
            pass
    assert not is_locked(path)
    with locked(path, wait=False):
        pass


def test_a_lock_ends_with_its_process(lock) -> None:
    locked, path = lock
    holder = subprocess.Popen(
        [sys.executable, "-c", HOLDER.format(function=locked.__name__), path],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    )
    with holder:
        assert holder.stdout.readline() == b"locked\n"
        assert is_locked(path)
        holder.kill()
    with locked(path):
        pass


def test_a_folder_that_is_removed_while_one_waits_is_not_locked(tmp_path, monkeypatch) -> None:
    folder = tmp_path / "folder"
    folder.mkdir()

    def replace_it(_descriptor: int, _operation: int) -> None:
        folder.rmdir()
        folder.mkdir()

    monkeypatch.setattr("fcntl.flock", replace_it)
    with pytest.raises(FileNotFoundError), locked_folder(folder):
        pass


def test_what_is_missing_is_not_locked(tmp_path) -> None:
    assert not is_locked(tmp_path / "missing")
    with pytest.raises(FileNotFoundError), locked_folder(tmp_path / "missing"):
        pass
