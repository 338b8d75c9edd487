"""Commands in messages run as they stand, whatever the reader has around them."""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from rl_workbench.errors import installing, replaying, watching


@pytest.fixture(params=["ws", "beside", "elsewhere"])
def place(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch, root: Path) -> str:
    """In the workspace; in an environment that is on PATH; with one that isn't."""
    monkeypatch.setenv("CARTPOLE_WS", str(root / "ws"))
    monkeypatch.delenv("CARTPOLE_WITH", raising=False)
    if request.param != "ws":
        monkeypatch.delenv("CARTPOLE_WS")
        folder = str(Path(sys.executable).parent)
        monkeypatch.setenv(
            "PATH", f"{folder}:/usr/bin:/bin" if request.param == "beside" else "/usr/bin:/bin"
        )
    return request.param


def test_how_to_watch_a_run(place: str, root: Path, tmp_path: Path) -> None:
    command = watching(tmp_path / "a run")
    begin = {
        "ws": f"{root}/ws tensorboard",
        "beside": "tensorboard",
        "elsewhere": f"{sys.executable} -m tensorboard.main",
    }[place]
    assert command == f"{begin} --logdir '{tmp_path}/a run'"
    words = shlex.split(command)[:-2]
    done = subprocess.run(
        [*words, "--version_tb"],
        cwd=tmp_path,
        env=dict(os.environ),
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.split()[-1][0].isdigit(), done.stdout


def test_how_to_replay_a_run(place: str, root: Path, tmp_path: Path) -> None:
    command = replaying(tmp_path / "a run")
    assert command.endswith(f" view '{tmp_path}/a run'")
    if place == "ws":
        assert command.startswith(f"{root}/ws rosrun cartpole workbench.py ")
        return
    words = [*shlex.split(command)[:-1], "--help"]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=True)
    assert "--checkpoint" in done.stdout


def test_a_run_of_a_module_of_ones_own_is_replayed_with_its_folder(
    root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As ws starts a process with --with; it names a folder with a space by a link."""
    for name in ("mine", "other arm"):
        (tmp_path / name).mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "other arm")
    monkeypatch.setenv("CARTPOLE_WS", str(root / "ws"))
    monkeypatch.setenv("CARTPOLE_WITH", f"{tmp_path}/mine:{tmp_path}/link")
    command = replaying(tmp_path / "run")
    folders = f"--with {tmp_path}/mine --with '{tmp_path}/other arm'"
    assert command == f"{root}/ws {folders} rosrun cartpole workbench.py view {tmp_path}/run"


def test_how_to_install_an_extra(place: str, root: Path) -> None:
    expected = f"{root}/ws extras" if place == "ws" else f"{sys.executable} -m pip install optuna"
    assert installing("optuna") == expected
