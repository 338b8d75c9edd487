"""Where `ws` builds: in the checkout, wherever that lies, or elsewhere if it can't be written."""

from __future__ import annotations

import os
import re
import shutil
import tempfile
from functools import partial
from pathlib import Path

import pytest
from support.python import run

STRANGE = ["ü a b", "new\nline\n", "semi;co:lon", "$HOME", 'quo"te\t', "l" * 99]


# --- who may write -----------------------------------------------------------------------------


@pytest.fixture
def foreign(root, nobody):
    """A checkout that belongs to somebody else, and an empty folder of one's own beside it."""
    with tempfile.TemporaryDirectory() as name:  # pytest's own are closed to other users
        folder = Path(name)
        folder.chmod(0o755)
        for part in ("tools", "requirements"):
            shutil.copytree(root / part, folder / "checkout" / part)
        shutil.copy(root / "ws", folder / "checkout")
        (folder / "checkout/requirements/base.txt").write_text("./no-such-folder\n")
        (folder / "own").mkdir()
        nobody.own(folder / "own")
        yield folder


@pytest.mark.slow
def test_missing_package_without_root_or_sudo(foreign, nobody):
    (foreign / "checkout/requirements/debian.txt").write_text("no-such-package  # a comment\n")
    result = nobody(foreign / "checkout/ws", "true", HOME=str(foreign / "own"))
    assert result.returncode == 1
    assert "administrator" in result.stderr
    assert "apt-get install --no-install-recommends no-such-package" in result.stderr


def test_two_users_of_one_checkout_have_masters_of_their_own(foreign, nobody):
    """Or one's training would move the other one's robot."""
    ours = run([foreign / "checkout/ws", "--help"], check=True).stdout
    theirs = nobody(foreign / "checkout/ws", "--help", HOME=str(foreign / "own")).stdout
    ports = [re.search(r"http://127.0.0.1:(2\d{4})\b", text)[1] for text in (ours, theirs)]
    assert ports[0] != ports[1]


@pytest.mark.slow
@pytest.mark.parametrize(("variable", "place"), [("HOME", "own/.cache/cartpole"), ("CARTPOLE_WS_DIR", "own")])
def test_what_cannot_be_made_in_the_checkout_is_made_elsewhere(foreign, nobody, variable, place):
    result = nobody(foreign / "checkout/ws", "true", **{variable: str(foreign / "own")})
    assert result.returncode == 1
    assert f"ready once, in {foreign / place}/" in result.stderr
    assert "no-such-folder" in result.stderr, "it came as far as the Python packages"
    (made,) = (foreign / place).iterdir()
    assert (made / "venv/bin/python3").exists()
    assert not (foreign / "checkout/.ws").exists()
    cleaned = nobody(foreign / "checkout/ws", "clean", **{variable: str(foreign / "own")})
    assert cleaned.returncode == 0
    assert not made.exists()


@pytest.mark.parametrize("home", [{}, {"HOME": "/no-home"}, {"CARTPOLE_WS_DIR": "own"}], ids=str)
def test_nowhere_to_write_is_one_line(foreign, nobody, home):
    result = nobody(foreign / "checkout/ws", "true", **home)
    assert result.returncode == 1
    (line,) = result.stderr.splitlines()
    assert line.startswith(f"ws: nothing can be made in {foreign}/checkout/.ws")
    assert "set CARTPOLE_WS_DIR to a folder that can" in line


@pytest.mark.slow
def test_a_workspace_that_is_ready_serves_who_cannot_write_it(open_root, nobody):
    """As on a read-only disk; what commands write goes to the user's own folders."""
    with tempfile.TemporaryDirectory() as home:
        nobody.own(home)
        code = "import os, rospy, trimesh, bullet_gazebo_msgs.srv; print(os.environ['ROS_LOG_DIR'])"
        result = nobody(open_root / "ws", "python3", "-c", code, HOME=home)
        assert (result.returncode, result.stderr) == (0, "")
        assert result.stdout.startswith(f"{home}/.cache/cartpole/")
        launch = ("roslaunch", "--files", "cartpole", "pg_train.launch")
        files = nobody(open_root / "ws", *launch, HOME=home)
        assert files.returncode == 0, files.stderr


# --- where a checkout may lie ------------------------------------------------------------------


@pytest.fixture(params=STRANGE, ids=ascii)
def strange(request, root, tmp_path, ws):
    """A checkout in a folder with a strange name; its link is gone afterwards."""
    copy = tmp_path / request.param
    shutil.copytree(root / "tools", copy / "tools")
    shutil.copy(root / "ws", copy)
    yield copy
    ws("clean", script=copy / "ws")


def links_to(folder):
    found = [path for path in Path("/tmp").glob("cartpole-*") if path.is_symlink()]
    return [path for path in found if os.readlink(path) == str(folder)]


def test_a_strange_path_gets_a_plain_name(ws, strange):
    assert ws("--help", script=strange / "ws").returncode == 0
    (link,) = links_to(strange)
    assert re.fullmatch(r"/tmp/cartpole-\d+-\d+", str(link))
    assert ws("clean", script=strange / "ws").returncode == 0
    assert links_to(strange) == []


@pytest.mark.slow
def test_all_works_below_a_strange_path(ws, root, tmp_path, tmp_path_factory):
    copy = tmp_path / "ü b:c$d(e&f%g;h\"i'j#k\\l\nm\n"
    hidden = shutil.ignore_patterns(".*", "__pycache__", "runs", "docs", "*_msgs")
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
