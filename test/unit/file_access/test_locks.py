"""Locks on folders: one holder at a time, and none once its process has ended."""

import subprocess
import sys

import pytest

from file_access.locks import is_locked, locked_folder

HOLDER = """
import sys
from pathlib import Path
from file_access.locks import locked_folder
with locked_folder(Path(sys.argv[1])):
    print("held", flush=True)
    sys.stdin.read()
"""


def test_a_second_holder_is_refused_until_the_block_ends(tmp_path) -> None:
    with locked_folder(tmp_path):
        assert is_locked(tmp_path)
        with pytest.raises(BlockingIOError), locked_folder(tmp_path):
            pass
    assert not is_locked(tmp_path)
    with locked_folder(tmp_path):
        pass


def test_a_lock_ends_with_its_process(tmp_path) -> None:
    command = [sys.executable, "-c", HOLDER, tmp_path]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as holder:
        assert holder.stdout.readline() and is_locked(tmp_path)
        holder.kill()
    with locked_folder(tmp_path):
        pass


def test_a_folder_that_is_removed_meanwhile_is_not_locked(tmp_path, monkeypatch) -> None:
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
