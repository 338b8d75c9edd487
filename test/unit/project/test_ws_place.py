"""Where `ws` builds: in the checkout, wherever that lies, or elsewhere where it can't."""

from __future__ import annotations

import os
import re
import shutil
from functools import partial
from pathlib import Path

import pytest

STRANGE = ["ü a b", "new\nline\n", "semi;co:lon", "$HOME", 'quo"te\t', "l" * 99]


def test_a_place_that_cannot_be_used_is_one_line(ws, checkout):
    done = ws("true", script=checkout / "ws", CARTPOLE_WS_DIR="own")
    (line,) = done.stderr.splitlines()
    assert done.returncode == 1 and "set CARTPOLE_WS_DIR to a folder that can" in line


def links_to(folder):
    found = [path for path in Path("/tmp").glob("cartpole-*") if path.is_symlink()]
    return [path for path in found if os.readlink(path) == str(folder)]


@pytest.mark.parametrize("name", STRANGE, ids=ascii)
def test_a_strange_path_gets_a_plain_name(ws, root, tmp_path, name):
    copy = tmp_path / name
    shutil.copytree(root / "tools", copy / "tools")
    shutil.copy(root / "ws", copy)
    assert ws("--help", script=copy / "ws").returncode == 0
    (link,) = links_to(copy)
    assert re.fullmatch(r"/tmp/cartpole-\d+-\d+", str(link))
    assert ws("clean", script=copy / "ws").returncode == 0
    assert links_to(copy) == []


@pytest.mark.slow
def test_all_works_below_a_strange_path(ws, root, tmp_path, tmp_path_factory):
    copy = tmp_path / "ü b:c$d(e&f%g;h\"i'j#k\\l\nm\n"
    hidden = shutil.ignore_patterns(".*", "__pycache__", "runs", "docs", "*_msgs", "*_attacher", "hector_*")
    shutil.copytree(root, copy, ignore=hidden)  # to generate messages takes long
    (copy / "docs").mkdir()
    (copy / "requirements/base.txt").write_text("")
    home = tmp_path_factory.mktemp("home")
    there = partial(ws, script=copy / "ws", HOME=str(home))
    try:
        built = there("rospack", "find", "gazebo_ros")
        assert built.returncode == 0, built.stderr
        code = "import rospy, ros_utils; print(ros_utils.__file__)"
        found = there("python3", "-c", code)
        assert found.returncode == 0, found.stderr
        assert found.stdout.endswith("ros_utils/__init__.py\n")
        launch = ("roslaunch", "--files", "gazebo_ros", "empty_world.launch")
        for command in (launch, ("gz", "--help")):
            result = there(*command)
            assert result.returncode == 0, result.stderr
    finally:
        there("clean")
    assert not list(home.rglob("*venv*"))


@pytest.mark.slow
def test_a_checkout_that_was_moved_is_made_ready_again(ws, root, tmp_path):
    """Virtual environment and CMake's cache hold the old path."""
    few = [each.name for each in (root / "companions").iterdir() if each.name != "gazebo_ros"]
    ignored = shutil.ignore_patterns(".*", "__pycache__", "runs", "docs", *few[1:])
    shutil.copytree(root, tmp_path / "here", ignore=ignored)
    (tmp_path / "here/docs").mkdir()
    (tmp_path / "here/requirements/base.txt").write_text("")
    for place in ("here", "dort drüben"):
        copy = (tmp_path / "here").rename(tmp_path / place)
        code = "import ros_utils, sys; print(sys.prefix, ros_utils.__file__, sep='\\n')"
        built = ws("bash", "-c", f'rospack find gazebo_ros && python3 -c "{code}"', script=copy / "ws")
        assert built.returncode == 0, built.stderr
        found = [Path(each).resolve() for each in built.stdout.splitlines()]
        assert len(found) == 3 and all(each.is_relative_to(copy) for each in found)
    ws("clean", script=copy / "ws")
