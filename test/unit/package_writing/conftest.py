"""Packages that new_robot.py has written, and that can be imported."""

import importlib
import os
import sys

import pytest

from package_writing import package
from package_writing.cli import main
from package_writing.trial import try_out

TASKS = ("Drive", "Walk", "Reach")


@pytest.fixture
def new(tmp_path, monkeypatch, capsys):
    """Writes packages, finds them, and gives the robot and the task; their modules are gone afterwards.

    Only those that stand are tried in a process of their own, which takes longer than all else.
    """
    target = tmp_path / "packages"
    target.mkdir()
    monkeypatch.setenv("ROS_PACKAGE_PATH", f"{target}:{os.environ.get('ROS_PACKAGE_PATH', '')}")
    monkeypatch.setattr(
        package, "try_out", lambda *given, stands: try_out(*given, stands=True) if stands else {}
    )

    def write(name, text=None, *arguments):
        if isinstance(text, str):
            (tmp_path / "robot.urdf").write_text(text)
            text = tmp_path / "robot.urdf"
        urdf = [] if text is None else ["--urdf", str(text)]
        code = main([name, *urdf, "--to", str(target), *arguments])
        told = capsys.readouterr()
        assert code == 0, told.err
        monkeypatch.syspath_prepend(target / name / "src")
        made = importlib.import_module(f"{name}.robot").ROBOT
        tasks = importlib.import_module(f"{name}.tasks")
        task = next(getattr(tasks, each) for each in TASKS if hasattr(tasks, each))
        return target / name, made, task, told.out

    before = set(sys.modules)
    yield write
    for name in set(sys.modules) - before:
        if name.partition(".")[0].startswith("my_"):
            del sys.modules[name]
