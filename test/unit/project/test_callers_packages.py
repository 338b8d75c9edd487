"""A workspace that the caller has built and sourced: its packages win over the companions."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from support import python

pytestmark = pytest.mark.slow
PACKAGE = """<package format="2"><name>{name}</name><version>9.9.9</version><description>d</description>
<maintainer email="a@example.com">a</maintainer><license>BSD</license>
<buildtool_depend>catkin</buildtool_depend><build_depend>message_generation</build_depend></package>"""
CMAKE = """cmake_minimum_required(VERSION 3.10)
project({name})
find_package(catkin REQUIRED COMPONENTS message_generation)
{messages}
catkin_package()
catkin_install_python(PROGRAMS scripts/{script} DESTINATION ${{CATKIN_PACKAGE_BIN_DESTINATION}})
"""
MESSAGES = "add_message_files(FILES Theirs.msg)\ngenerate_messages()"
SCRIPT = "#!/usr/bin/env python3\nimport sys\nprint('theirs', sys.executable)\n"
# A package of the caller's, and its program.
PACKAGES = {
    "control_msgs": "show",
    "controller_manager": "spawner",
    "xacro": "xacro",
    "gazebo_ros": "spawn_model",
    "cartpole": "pg_train.py",
    "their_robot": "drive",
}
THEIRS = ["control_msgs", "controller_manager", "xacro", "their_robot"]
ALWAYS_OURS = ["cartpole", "gazebo_ros", "bullet_gazebo_msgs"]


@pytest.fixture(scope="module")
def workspace(tmp_path_factory):
    """A catkin workspace of the caller's, built without ws, which has six packages."""
    workspace = tmp_path_factory.mktemp("their_ws")
    for name, script in PACKAGES.items():
        folder = workspace / "src" / name
        (folder / "msg").mkdir(parents=True)
        (folder / "scripts").mkdir()
        messages = MESSAGES if name == "control_msgs" else ""
        (folder / "package.xml").write_text(PACKAGE.format(name=name))
        text = CMAKE.format(name=name, messages=messages, script=script)
        (folder / "CMakeLists.txt").write_text(text)
        (folder / "msg/Theirs.msg").write_text("float64 x\n")
        (folder / "scripts" / script).write_text(SCRIPT)
        (folder / "scripts" / script).chmod(0o755)
    run(["/usr/bin/catkin_make", "-DPYTHON_EXECUTABLE=/usr/bin/python3"], cwd=workspace)
    return workspace


def run(command, cwd=None, **environment):
    plain = {"PATH": "/usr/bin:/bin", "HOME": os.environ["HOME"]}
    plain["ROS_LANG_DISABLE"] = "gencpp:genlisp"
    done = python.run(command, cwd=cwd, env=plain | environment)
    assert done.returncode == 0, f"{done.stdout[-3000:]}\n{done.stderr[-3000:]}"
    return done.stdout


def sourced_before(root, workspace, *command):
    enter = 'enter() { source "$1"; }; enter "$0/devel/setup.bash"; exec "$@"'
    return run(["bash", "-c", enter, workspace, root / "ws", *command])


def sourced_after(root, workspace, *command):
    enter = 'enter() { source "$1" --extend; }; enter "$0/devel/setup.bash"; exec "$@"'
    return run([root / "ws", "bash", "-c", enter, workspace, *command])


def nested(root, workspace, *command):
    return sourced_before(root, workspace, root / "ws", *command)


@pytest.mark.parametrize("way", [sourced_after, nested])  # nested has it sourced before, too
def test_the_callers_packages_modules_and_programs_come_first(root, workspace, way):
    find = f"for p in {' '.join(THEIRS)}; do rospack find $p; done"
    found = way(root, workspace, "bash", "-c", find).split()
    assert found == [str(workspace / "src" / name) for name in THEIRS]
    code = (
        "import control_msgs.msg, gazebo_msgs, controller_manager_msgs, numpy, rospy\n"
        "control_msgs.msg.Theirs(x=1.0)\n"
        "for each in (control_msgs, gazebo_msgs, numpy): print(each.__file__)"
    )
    theirs, ours, numpy = way(root, workspace, "python3", "-c", code).splitlines()
    assert Path(theirs).is_relative_to(workspace)
    assert Path(ours).is_relative_to(root / ".ws/companions")
    assert Path(numpy).is_relative_to(root / ".ws/venv")
    for name in ("xacro", "their_robot"):
        # With the interpreter that they were built for.
        printed = way(root, workspace, "rosrun", name, PACKAGES[name])
        assert printed == "theirs /usr/bin/python3\n"


def test_what_stands_in_for_gazebo_stays_ours(root, workspace):
    find = f"for p in {' '.join(ALWAYS_OURS)}; do rospack find $p; done"
    for path in sourced_before(root, workspace, "bash", "-c", find).split():
        assert Path(path).resolve().is_relative_to(root)
    for name in ("cartpole", "gazebo_ros"):
        helped = sourced_before(root, workspace, "rosrun", name, PACKAGES[name], "--help")
        assert "theirs" not in helped


def test_only_on_ros_package_path(root, workspace):
    """Then ws builds what has to be built, in a place of its own; more in test_ws_with.py."""

    def ws(*command):
        return run([root / "ws", *command], ROS_PACKAGE_PATH=str(workspace / "src")).strip()

    assert ws("rospack", "find", "their_robot") == str(workspace / "src/their_robot")
    assert ws("rospack", "find", "control_msgs") == str(workspace / "src/control_msgs")
    for name in ("cartpole", "bullet_gazebo_msgs"):
        assert Path(ws("rospack", "find", name)).is_relative_to(root)
    module = ws("python3", "-c", "import control_msgs.msg as m; m.Theirs; print(m.__file__)")
    assert Path(module).is_relative_to(root / ".ws/with")


def test_a_whole_ros_is_left_out(root, tmp_path):
    """Its rospy would be another one than Debian's, which the rest is made for."""
    modules = tmp_path / "lib/python3/dist-packages"
    for name in ("rospy", "control_msgs"):
        (modules / name).mkdir(parents=True)
        (modules / name / "__init__.py").write_text("raise ImportError('a stranger')")
    (tmp_path / "share/rospy").mkdir(parents=True)
    (tmp_path / ".catkin").touch()
    command = [root / "ws", "python3", "-c", "import rospy, control_msgs.msg"]
    run(command, CMAKE_PREFIX_PATH=str(tmp_path), PYTHONPATH=str(modules))
