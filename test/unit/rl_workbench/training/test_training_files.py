"""What a training writes: checkpoints, curve, run folder, progress."""

import io
import os
from pathlib import Path
from typing import BinaryIO

import pytest
import torch

from rl_workbench.agents.pg.document import Losses, PolicyGradientAgent
from rl_workbench.errors import WorkbenchError
from rl_workbench.training.pg.loop import EpisodeRecord
from rl_workbench.training.run import folder as run_folder
from rl_workbench.training.run.files import NetworkSaver, write_atomically
from rl_workbench.training.run.progress import Bar, Lines, progress


def record(index: int, length: int = 10) -> EpisodeRecord:
    return EpisodeRecord(index, length, length / 2, Losses(1.0, 2.0), 1000.0, 10)


def names(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def test_a_write_that_fails_keeps_the_old_file(tmp_path: Path) -> None:
    path = tmp_path / "weights.pth"
    write_atomically(path, lambda stream: stream.write(b"old"))

    def fail(stream: BinaryIO) -> None:
        stream.write(b"half")
        raise OSError(28, "No space left on device")

    with pytest.raises(OSError, match="No space"):
        write_atomically(path, fail)
    assert path.read_bytes() == b"old"
    assert names(tmp_path) == {"weights.pth"}


def test_the_name_appears_only_with_the_whole_content(tmp_path: Path) -> None:
    path = tmp_path / "weights.pth"

    def look(stream: BinaryIO) -> None:
        stream.write(b"x" * 100000)
        assert not path.exists()

    write_atomically(path, look)
    assert path.stat().st_size == 100000


def test_a_written_file_follows_the_umask(tmp_path: Path) -> None:
    old = os.umask(0o027)
    try:
        write_atomically(tmp_path / "file", lambda stream: stream.write(b""))
    finally:
        os.umask(old)
    assert (tmp_path / "file").stat().st_mode & 0o777 == 0o640


def test_networks_are_saved_every_so_often_and_load_safely(tmp_path: Path) -> None:
    agent = PolicyGradientAgent(0)
    saver = NetworkSaver(tmp_path, agent, every=2)
    for index in range(4):
        saver.episode_done(record(index))
    saver.save()
    expected = {
        f"{kind}_network{suffix}.pth"
        for kind in ("policy", "value")
        for suffix in ("", "_episode_0", "_episode_2")
    }
    assert names(tmp_path) == expected
    loaded = torch.load(tmp_path / "policy_network.pth", weights_only=True)
    assert set(loaded) == {"fc.weight", "fc.bias"}
    assert torch.equal(loaded["fc.weight"], agent.policy.fc.weight)
    value = torch.load(tmp_path / "value_network.pth", weights_only=True)
    assert set(value) == {"fc1.weight", "fc1.bias", "fc2.weight", "fc2.bias"}


def test_zero_saves_only_when_asked(tmp_path: Path) -> None:
    NetworkSaver(tmp_path, PolicyGradientAgent(0), every=0).episode_done(record(0))
    assert names(tmp_path) == set()


def test_the_default_run_folder_is_new_each_time(tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    first = run_folder.create(None, "cartpole", "pg", 7)
    second = run_folder.create("", "cartpole", "pg", 7)
    assert first != second
    assert first.parent == tmp_path / "runs"
    assert first.name.startswith("cartpole__pg__7__")


def test_a_run_folder_in_use_is_refused(tmp_path: Path) -> None:
    (tmp_path / "old").write_text("")
    with pytest.raises(WorkbenchError, match="isn't empty"):
        run_folder.create(str(tmp_path), "cartpole", "pg", 0)


def test_an_empty_run_folder_is_used(tmp_path: Path) -> None:
    assert run_folder.create(str(tmp_path), "cartpole", "pg", 0) == tmp_path
    assert names(tmp_path) == set()


def test_a_run_folder_that_cannot_be_made_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(WorkbenchError, match=r"can't write to the run folder .*Not a directory"):
        run_folder.create(str(tmp_path / "file" / "run"), "cartpole", "pg", 0)


def test_without_a_terminal_a_line_every_20_episodes() -> None:
    stream = io.StringIO()
    shown = progress(45, stream)
    assert isinstance(shown, Lines)
    for index in range(45):
        shown.episode_done(record(index, length=index))
    lines = stream.getvalue().splitlines()
    assert len(lines) == 2
    assert "20/45" in lines[0] and "9.5" in lines[0]
    assert "40/45" in lines[1] and "29.5" in lines[1]


def test_on_a_terminal_a_bar() -> None:
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    stream = Terminal()
    shown = progress(5, stream)
    assert isinstance(shown, Bar)
    for index in range(5):
        shown.episode_done(record(index))
    shown.close()
    assert "5/5" in stream.getvalue()
    assert "steps/s" in stream.getvalue()
