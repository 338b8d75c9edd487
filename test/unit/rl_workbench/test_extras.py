"""Commands in messages run as they stand, whatever the reader has around them."""

import os
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from rl_workbench.errors import Hints


@pytest.fixture(params=["beside", "elsewhere"])
def is_beside(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> bool:
    """In an environment that is on PATH; with one that isn't."""
    folder = f"{Path(sys.executable).parent}:" if request.param == "beside" else ""
    monkeypatch.setenv("PATH", f"{folder}/usr/bin:/bin")
    return bool(folder)


def printed(command: str, *arguments: str, cwd: Path) -> str:
    words = [*shlex.split(command), *arguments]
    return subprocess.run(
        words, cwd=cwd, env=dict(os.environ), capture_output=True, text=True, check=True
    ).stdout


def test_how_to_watch_a_run(is_beside: bool, tmp_path: Path) -> None:
    command = Hints().watching(tmp_path / "a run")
    begin = "tensorboard" if is_beside else f"{sys.executable} -m tensorboard.main"
    assert command == f"{begin} --logdir '{tmp_path}/a run'"
    assert printed(begin, "--version_tb", cwd=tmp_path).split()[-1][0].isdigit()


def test_how_to_replay_a_run(is_beside: bool, tmp_path: Path) -> None:
    command = Hints().replaying(tmp_path / "a run")
    assert command.endswith(f" view '{tmp_path}/a run'")
    assert "--checkpoint" in printed(command, "--help", cwd=tmp_path)


def test_how_to_install_an_extra() -> None:
    assert Hints().installing("optuna") == f"{sys.executable} -m pip install optuna"
