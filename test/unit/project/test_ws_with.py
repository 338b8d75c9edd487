"""The user's folders in `ws`: --with, CARTPOLE_WITH, ROS_PACKAGE_PATH; their packages and modules."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow  # what one test has built is there for the next
XML = """<package format="2"><name>{name}</name><version>0.0.1</version><description>d</description>
<maintainer email="a@example.com">a</maintainer><license>BSD</license>
<buildtool_depend>catkin</buildtool_depend>{depends}</package>"""
CMAKE = "cmake_minimum_required(VERSION 3.10)\nproject({name})\nfind_package(catkin REQUIRED{needs})\n"
MESSAGES = "catkin_python_setup()\nadd_message_files(FILES Tip.msg)\ngenerate_messages()\ncatkin_package()\n"
SETUP = """from catkin_pkg.python_setup import generate_distutils_setup
from setuptools import setup
setup(**generate_distutils_setup(packages=["{name}"], package_dir={{"": "src"}}))
"""
DRIVE = """#!/usr/bin/env python3
from my_messages import msg, tasks
print(tasks.X, msg.Tip(x=2))
"""
NEEDY = "needy (it needs nowhere, which isn't installed)"
FIND = "for p in {}; do rospack find $p; done"


def package(folder: Path, name: str, cmake: str = "", *depends: str, more: str = "") -> Path:
    made = folder / name
    made.mkdir(parents=True)
    lines = [f"<depend>{each}</depend>" for each in depends]
    (made / "package.xml").write_text(XML.format(name=name, depends="".join(lines) + more))
    if cmake:
        (made / "code.cpp").touch()
        needs = f" COMPONENTS {' '.join(depends)}" if depends else ""
        (made / "CMakeLists.txt").write_text(CMAKE.format(name=name, needs=needs) + cmake)
    return made


def script(path: Path, text: str) -> None:
    path.parent.mkdir(exist_ok=True)
    path.write_text(text)
    path.chmod(0o755)


@pytest.fixture(scope="module")
def workspace(tmp_path_factory):
    """A folder with a blank and a letter of Spain in its path; packages and modules of all kinds."""
    folder = tmp_path_factory.mktemp("user") / "mañana ws"
    source = folder / "src"
    messages = package(source, "my_messages", MESSAGES, "message_generation")
    (messages / "msg").mkdir()
    (messages / "msg/Tip.msg").write_text("float64 x\n")
    (messages / "setup.py").write_text(SETUP.format(name="my_messages"))
    (messages / "src/my_messages").mkdir(parents=True)
    (messages / "src/my_messages/__init__.py").touch()
    (messages / "src/my_messages/tasks.py").write_text("X = 1\n")
    script(messages / "scripts/drive", DRIVE)

    plain = package(source, "my_arm", "catkin_python_setup()\ncatkin_package()\n")
    (plain / "setup.py").write_text(SETUP.format(name="my_arm"))
    (plain / "src/my_arm").mkdir(parents=True)
    (plain / "src/my_arm/__init__.py").write_text("ARM = 1\n")
    script(plain / "scripts/drive.py", "#!/usr/bin/env python3\nimport my_arm\n")
    (plain / "launch").mkdir()
    (plain / "launch/arm.launch").write_text(
        '<launch><arg name="gui" default="true"/><param name="p" textfile="$(find my_arm)/package.xml"/>'
        '<node name="n" pkg="my_messages" type="drive"/></launch>'
    )
    ours = package(source, "cartpole_gazebo")
    script(ours / "scripts/whose", "#!/bin/sh\necho theirs\n")
    package(source / "deeper", "gazebo_ros")
    package(source / "build", "hidden")
    (source / "build/CMakeCache.txt").touch()
    (folder / "my_env.py").write_text(
        "from gymnasium import register\n"
        "register('MyEnv-v0', 'gymnasium.envs.classic_control:CartPoleEnv', max_episode_steps=50)\n"
    )
    return folder


def test_first_call_builds_and_tells_what_is_theirs(ws, workspace):
    first = ws("--with", str(workspace), "rosrun", "my_messages", "drive")
    assert (first.returncode, first.stdout) == (0, "1 x: 2\n"), first.stderr
    building, done, gazebo, ros = first.stderr.splitlines()
    assert "building your package my_messages" in building and "my_messages: done" in done
    assert "cartpole_gazebo is yours" in gazebo and "gazebo_ros is yours" in ros
    again = ws(f"--with={workspace}", "rosrun", "my_messages", "drive")
    assert (again.stdout, again.stderr) == ("1 x: 2\n", "")


@pytest.mark.parametrize("how", ["--with", "CARTPOLE_WITH", "ROS_PACKAGE_PATH", "nested"])
def test_packages_and_modules_are_found(ws, root, workspace, how):
    code = "import my_arm, my_messages.msg, my_messages.tasks, my_env; print(my_arm.ARM)"
    command = ("python3", "-c", code)
    if how == "--with":
        done = ws("--with", str(workspace), *command)
    elif how == "nested":
        done = ws("--with", "src/my_arm", root / "ws", "--with", ".", root / "ws", *command, cwd=workspace)
    else:
        done = ws(*command, **{how: str(workspace)})
    assert (done.returncode, done.stdout) == (0, "1\n"), done.stderr
    assert all(line.startswith("ws: ") for line in done.stderr.splitlines()), done.stderr


def test_the_commands_of_the_page(ws, root, workspace, tmp_path):
    """Those of docs/catkin.md with this workspace as ~/my_ws; the launch file is not started."""
    text = (root / "docs/catkin.md").read_text()
    lines = re.findall(r"^    \./ws (--with ~/my_ws .*)$", text, re.MULTILINE)
    assert lines
    for line in lines:
        words = [word.replace("~/my_ws", str(workspace)) for word in line.split()]
        if "roslaunch" in words:
            words.insert(3, "--nodes")
        if "pg_train.py" in words:
            words += ["--episodes=2", "--eval-episodes=1", "--run-dir=run"]
        done = ws(*words, cwd=tmp_path)
        assert done.returncode == 0, (line, done.stderr)


def test_names_of_ours_do_not_hide_theirs(ws, workspace):
    for environment in ({}, {"ROS_PACKAGE_PATH": str(workspace / "src")}):
        options = [] if environment else ["--with", str(workspace)]
        whose = ws(*options, "rosrun", "cartpole_gazebo", "whose", **environment)
        assert whose.stdout == "theirs\n", whose.stderr
        find = FIND.format("cartpole_gazebo gazebo_ros cartpole_controller hidden")
        places = ws(*options, "bash", "-c", find, **environment).stdout.splitlines()
        theirs = [Path(each).resolve().is_relative_to(workspace) for each in places]
        assert theirs == [True, True, False]
        code = "import roslib.packages as p; print(p.find_resource('cartpole_gazebo', 'whose')[0])"
        found = ws(*options, "python3", "-c", code, **environment).stdout.strip()
        assert Path(found).resolve().is_relative_to(workspace)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--with"], "--with needs a folder"),
        (["--with", ""], "--with needs a folder"),
        (["--with", "no such"], "there is no folder 'no such'"),
        (["--with", "file"], "there is no folder 'file'"),
        (["--with", "/"], "the whole disk"),
        (["--with", "."], "needs a command"),
    ],
)
def test_a_wrong_option_is_one_line(ws, tmp_path, arguments, words):
    (tmp_path / "file").touch()
    done = ws(*arguments, *(["true"] if arguments[-1] in ("no such", "file") else []), cwd=tmp_path)
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert words in line


def test_a_folder_in_the_environment_that_is_not_there(ws, tmp_path):
    done = ws("true", CARTPOLE_WITH=f"{tmp_path}:{tmp_path}/none")
    assert done.returncode == 2
    assert f"CARTPOLE_WITH: there is no folder '{tmp_path}/none'" in done.stderr
    done = ws("echo", "on", ROS_PACKAGE_PATH=f"{tmp_path}/none")
    assert (done.returncode, done.stdout) == (0, "on\n"), "as ROS has it"
    assert "there is no folder" in done.stderr


def test_what_cannot_be_used_is_said_and_the_rest_works(ws, tmp_path):
    package(tmp_path, "good")
    for place in ("one", "two"):
        package(tmp_path / place, "twice")
    package(tmp_path, "cartpole")
    (tmp_path / "broken").mkdir()
    (tmp_path / "broken/package.xml").write_text("<package><name>broken</nam")
    package(tmp_path, "needy", "find_package(nowhere REQUIRED)\nadd_custom_target(x)\n")
    package(tmp_path, "needier", "add_custom_target(y)\n", "needy")
    ros = package(tmp_path / "theirs", "gazebo_ros", "", "gazebo_dev")
    (tmp_path / "robot_envs.py").touch()
    (tmp_path / "random.py").touch()
    (tmp_path / "loop").symlink_to(tmp_path)
    first = ws("--with", ".", "bash", "-c", FIND.format("good twice gazebo_ros"), cwd=tmp_path)
    good, twice, gazebo_ros = first.stdout.splitlines()
    assert (good, twice) == (str(tmp_path / "good"), str(tmp_path / "one/twice"))
    assert gazebo_ros != str(ros)
    again = ws("--with", ".", "true", cwd=tmp_path)
    assert again.returncode == 0
    for words in (
        "broken/package.xml",
        f"two packages are named twice: {tmp_path}/one/twice is used, {tmp_path}/two/twice isn't",
        "the name cartpole is this checkout's",
        f"{tmp_path}/robot_envs.py can't be imported",
        f"{tmp_path}/random.py hides Python's own module",
    ):
        (line,) = [each for each in again.stderr.splitlines() if words in each]
        assert line.startswith("ws: ") and line in first.stderr
    unbuilt = f"not built: {NEEDY}, needier (it needs needy)"
    for words in ("gazebo_ros is for Gazebo itself", unbuilt):
        assert first.stderr.count(words) == 1
        assert words not in again.stderr
    assert "building your package" not in again.stderr


def test_what_failed_is_built_once_it_has_changed(ws, tmp_path):
    waiting = package(tmp_path, "waiting", "file(READ missing text)\ncatkin_package()\n")
    package(tmp_path, "after", "add_custom_target(y)\n", "waiting")
    told = ws("--with", str(tmp_path), "true").stderr.splitlines()
    assert "building your package waiting" in told[0]
    assert "not built: waiting (CMake Error" in told[1] and "docs/controllers.md" in told[1]
    assert len(told) == 2
    assert ws("--with", str(tmp_path), "true").stderr == "", "told once, and not tried again"
    (waiting / "missing").touch()
    (waiting / "code.cpp").write_text("// mended")
    mended = ws("--with", str(tmp_path), "true").stderr
    assert "waiting: done" in mended and "after: done" in mended and "not built" not in mended
    assert ws("--with", str(tmp_path), "true").stderr == ""


def test_packages_of_descriptions_are_found_by_cmake_and_not_built(ws, tmp_path):
    """Their CMakeLists.txt may ask for what isn't installed, such as what their launch files start."""
    described = package(tmp_path, "some_description", "add_custom_target(x)\n", "no_such_gui")
    (described / "code.cpp").unlink()
    uses = "catkin_package(CATKIN_DEPENDS some_description)\nadd_custom_target(x)\n"
    package(tmp_path, "some_driver", uses, "some_description")
    told = ws("--with", str(tmp_path), "true").stderr.splitlines()
    assert len(told) == 2 and "some_driver: done" in told[1]
    found = ws("--with", str(tmp_path), "rospack", "find", "some_description").stdout
    assert found == f"{described}\n"


def test_packages_for_ros_2_are_used_for_their_files(ws, tmp_path):
    ament = "<export><build_type{}>ament_cmake</build_type></export>"
    package(tmp_path, "other_description", "find_package(ament_cmake REQUIRED)\n", more=ament.format(""))
    package(tmp_path, "gazebo_msgs", more=ament.format(""))
    both = package(tmp_path, "for_both", "add_custom_target(x)\n")
    text = XML.format(name="for_both", depends=ament.format(' condition="$ROS_VERSION == 2"'))
    (both / "package.xml").write_text(text.replace('"2"', '"3"'))
    find = FIND.format("other_description gazebo_msgs for_both")
    done = ws("--with", str(tmp_path), "bash", "-c", find)
    description, msgs, of_both = done.stdout.splitlines()
    assert description == str(tmp_path / "other_description") and of_both == str(both)
    assert not msgs.startswith(str(tmp_path))
    assert "for ROS 2, used for their files (URDF, meshes): other_description\n" in done.stderr
    assert "gazebo_msgs is for ROS 2; this checkout's is used" in done.stderr
    assert "for_both: done" in done.stderr


def test_what_changes_is_built_anew_and_what_goes_is_gone(ws, tmp_path):
    made = package(tmp_path, "changing", MESSAGES.partition("\n")[2], "message_generation")
    (made / "msg").mkdir()
    (made / "msg/Tip.msg").write_text("float64 x\n")
    show = ("--with", str(tmp_path), "rosmsg", "show", "changing/Tip")
    assert ws(*show).stdout == "float64 x\n\n"
    (made / "msg/Tip.msg").write_text("float64 x\nfloat64 y\n")
    assert ws(*show).stdout == "float64 x\nfloat64 y\n\n"
    code = "import changing.msg; print(changing.msg.Tip(y=1).y)"
    python = ("--with", str(tmp_path), "python3", "-c", code)
    assert ws(*python).stdout == "1\n"
    shutil.rmtree(made)
    (tmp_path / "module.py").touch()
    assert ws(*python).returncode == 1


def test_two_at_once(root, tmp_path):
    """The second waits for the first, and uses what that has built."""
    made = package(tmp_path, "shared", MESSAGES.partition("\n")[2], "message_generation")
    (made / "msg").mkdir()
    (made / "msg/Tip.msg").write_text("float64 x\n")
    command = [root / "ws", "--with", tmp_path, "python3", "-c", "import shared.msg"]
    both = [subprocess.Popen(command, stderr=subprocess.PIPE, text=True) for _ in range(2)]
    texts = [each.communicate(timeout=180)[1] for each in both]
    assert [each.returncode for each in both] == [0, 0], texts
    assert sum("building" in text for text in texts) == 1
