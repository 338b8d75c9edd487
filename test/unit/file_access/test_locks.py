"""Locks on folders: one holder at a time, and none once its process has ended."""

import signal
import subprocess
import sys
from pathlib import Path

import pytest

from file_access.locks import SCRATCH, is_locked, locked_folder, scratch_folder

HOLDER = """
import sys
from pathlib import Path
from file_access import locks
with locks.locked_folder(Path(sys.argv[1])):
    print("locked", flush=True)
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
    holder = subprocess.Popen(
        [sys.executable, "-c", HOLDER, tmp_path], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    with holder:
        assert holder.stdout.readline() == b"locked\n"
        assert is_locked(tmp_path)
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


MAKER = """
import sys
from file_access import locks
with locks.scratch_folder(sys.argv[1]) as folder:
    (folder / "file").write_text("")
    print(folder, flush=True)
    sys.stdin.read()
"""


def made(parent: Path) -> tuple[subprocess.Popen, Path]:
    maker = subprocess.Popen(
        [sys.executable, "-c", MAKER, parent], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    return maker, Path(maker.stdout.readline().decode().strip())


def test_temporary_folders_of_killed_processes_go_with_the_next_one(tmp_path) -> None:
    (lives, kept), (killed, left) = made(tmp_path), made(tmp_path)
    killed.send_signal(signal.SIGKILL)
    killed.wait()
    users, link = tmp_path / "results".join(SCRATCH), tmp_path / "far_away".join(SCRATCH)
    users.mkdir()
    link.symlink_to(users)
    with scratch_folder(str(tmp_path)) as own:
        assert {*tmp_path.iterdir()} == {own, kept, users, link}
        assert left.name != own.name and (kept / "file").exists()
    lives.communicate()
    assert {*tmp_path.iterdir()} == {users, link}
