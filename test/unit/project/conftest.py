"""Fixtures for the tests of `ws`."""

from __future__ import annotations

import os
import shutil
import subprocess

import pytest


@pytest.fixture
def ws(root):
    """Returns a function that runs ws with a user's environment, not with the tests' own."""

    def run(*arguments, cwd=None, script=root / "ws", **environment):
        plain = {"PATH": "/usr/local/bin:/usr/bin:/bin", "HOME": os.environ["HOME"]} | environment
        return subprocess.run(
            [script, *arguments],
            check=False,
            cwd=cwd,
            env={name: value for name, value in plain.items() if value is not None},
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=120,
        )

    return run


@pytest.fixture
def open_root(root):
    """Returns this checkout, if root can become another user who reaches it."""
    if os.geteuid() != 0:
        pytest.skip("only root can become a user without rights")
    for folder in (root, *root.parents):
        if not folder.stat().st_mode & 0o001:
            pytest.skip(f"{folder} is closed to others")
    return root


@pytest.fixture
def checkout(root, tmp_path, ws):
    """A second checkout, with a blank in its path, that holds just what the first steps need."""
    copy = tmp_path / "second checkout"
    for name in ("tools", "requirements"):
        shutil.copytree(root / name, copy / name)
    shutil.copy(root / "ws", copy)
    yield copy
    ws("clean", script=copy / "ws")  # also removes the link that stands in for such a path
