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


class Nobody:
    """A user without rights, and without a terminal that sudo could ask on."""

    number = 65534

    def __call__(self, script, *arguments, **environment):
        return run(
            [script, *arguments], user=self.number, group=self.number, extra_groups=[], cwd="/",
            env={"PATH": "/usr/bin:/bin"} | environment, start_new_session=True,
        )  # fmt: skip

    def own(self, folder):
        os.chown(folder, self.number, self.number)


@pytest.fixture
def nobody():
    """Runs commands; only root can become another user."""
    if os.geteuid() != 0:
        pytest.skip("only root can become another user")
    return Nobody()


@pytest.fixture
def open_root(root):
    """Returns this checkout, if other users reach it."""
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
