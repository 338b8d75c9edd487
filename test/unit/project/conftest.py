"""Fixtures for the tests of `ws`."""

from __future__ import annotations

import os
import shutil

import pytest
from support.python import run


@pytest.fixture
def ws(root):
    """Returns a function that runs ws with a user's environment, not with the tests' own."""

    def call(*arguments, cwd=None, script=root / "ws", **environment):
        plain = {"PATH": "/usr/local/bin:/usr/bin:/bin", "HOME": os.environ["HOME"]} | environment
        return run([script, *arguments], cwd=cwd, env=plain)

    return call


@pytest.fixture
def checkout(root, tmp_path, ws):
    """A second checkout, with a blank in its path, that holds just what the first steps need."""
    copy = tmp_path / "second checkout"
    for name in ("tools", "requirements"):
        shutil.copytree(root / name, copy / name)
    shutil.copy(root / "ws", copy)
    yield copy
    ws("clean", script=copy / "ws")  # also removes the link that stands in for such a path
