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
with locks.{}(Path(sys.argv[1])) as folder:
    print(folder, flush=True)
    sys.stdin.read()
"""


def held(how: str, folder: Path) -> tuple[subprocess.Popen, str]:
    """A process that holds a folder by a function of the module, and which one it has got."""
    command = [sys.executable, "-c", HOLDER.format(how), folder]
    holder = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    return holder, holder.stdout.readline().strip()


def test_a_second_holder_is_refused_until_the_block_ends(tmp_path) -> None:
    with locked_folder(tmp_path):
        assert is_locked(tmp_path)
        with pytest.raises(BlockingIOError), locked_folder(tmp_path):
            pass
    assert not is_locked(tmp_path)
    with locked_folder(tmp_path):
        pass


def test_a_lock_ends_with_its_process(tmp_path) -> None:
    holder, told = held("locked_folder", tmp_path)
    with holder:
        assert told and is_locked(tmp_path)
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


def test_temporary_folders_of_killed_processes_go_with_the_next_one(tmp_path) -> None:
    (lives, kept), (killed, left) = (held("scratch_folder", tmp_path) for _ in range(2))
    kept, left = Path(kept), Path(left)
    for each in (kept, left):
        (each / "file").touch()
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
