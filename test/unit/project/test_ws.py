"""`ws` called as a user calls it: command line, environment, network."""

from __future__ import annotations

import os
import re
import signal
import socket
import subprocess
import time
from pathlib import Path

import pytest

URDF = Path(__file__).resolve().parents[3] / "urdf/cartpole.urdf.xacro"
PROBE = "import os, sys; print(os.environ.get(sys.argv[1], '-'))"


def variable(ws, name, **environment):
    return ws("python3", "-c", PROBE, name, **environment).stdout.strip()


# --- the command line --------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "code", "output"),
    [
        (["--help"], 0, "test --fast"),
        ([], 1, "usage: ws CMD"),
        (["--nonsense"], 2, "unknown option --nonsense"),
        (["docs", "--help"], 2, "docs: unknown option --help"),
        (["tset"], 2, "did you mean: ws test? If not: ws "),
        (["checks"], 2, "did you mean: ws check?"),
        (["chekc"], 2, "did you mean: ws check?"),
        (["cean"], 2, "did you mean: ws clean?"),
        (["no-such-command"], 127, "no such command: no-such-command"),
        (["python3", "-c", "raise SystemExit(3)"], 3, ""),
        (["check", "nonsense"], 2, "no check 'nonsense', only lint format imports types"),
    ],
    ids=str,
)
def test_the_command_line(ws, arguments, code, output):
    result = ws(*arguments)
    assert result.returncode == code
    assert output in result.stdout + result.stderr


def test_a_check_that_there_is_none_of_installs_nothing(ws, checkout):
    result = ws("check", "lint", "nonsense", script=checkout / "ws")
    assert (result.returncode, result.stdout) == (2, "") and not (checkout / ".ws").exists()


def test_signal_reaches_the_command(ws, root):
    code = "import signal; print('up', flush=True); signal.pause()"
    command = [root / "ws", "python3", "-c", code]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline() == "up\n"
        process.send_signal(signal.SIGTERM)
        assert process.wait(60) == -signal.SIGTERM


def test_arguments_stay_whole(ws):
    arguments = ["two words", "", "*", "$HOME", "a'b\"c", "--help", "back\\slash"]
    result = ws("python3", "-c", "import sys; print(sys.argv[1:])", *arguments)
    assert result.stdout.strip() == repr(arguments)


def test_stays_in_the_callers_folder(ws, tmp_path):
    assert ws("pwd", cwd=tmp_path).stdout.strip() == str(tmp_path)


def test_through_a_link(ws, root, tmp_path):
    link = tmp_path / "a link"
    link.symlink_to(root / "ws")
    result = ws("python3", "-c", "import bullet_gazebo_msgs.srv", script=link, cwd=tmp_path)
    assert result.returncode == 0, result.stderr


def test_ready_workspace_is_quiet(ws):
    ws("true")
    result = ws("true")
    assert (result.stdout, result.stderr) == ("", "")


# --- the environment of a command --------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("name", ["python", "python3"])
def test_interpreter_is_the_workspaces(ws, root, name):
    code = "import bullet_gazebo_msgs.srv, rospy, trimesh, cartpole, sys; print(sys.prefix)"
    result = ws(name, "-c", code)
    assert Path(result.stdout.strip()).resolve() == root / ".ws/venv", result.stderr


@pytest.mark.slow
@pytest.mark.parametrize(
    "command",
    [
        ("rospack", "find", "cartpole"),
        ("roslaunch", "--files", "gazebo_ros", "empty_world.launch"),
        ("rostest", "--help"),
        ("rossrv", "show", "bullet_gazebo_msgs/StepWorld"),
        ("catkin_find", "cartpole", "--share"),
        ("rosrun", "xacro", "xacro", str(URDF)),
        ("rosrun", "xacro", "xacro.py", str(URDF)),  # as $(find xacro)/xacro.py
    ],
    ids=" ".join,
)
def test_ros_commands(ws, command):
    result = ws(*command)
    assert result.returncode == 0, result.stderr
    assert result.stdout.strip()


@pytest.mark.slow
@pytest.mark.parametrize("command", [("xacro",), ("rosrun", "xacro", "xacro")])
def test_xacro_is_the_one_with_limits(ws, tmp_path, command):
    path = tmp_path / "robot.xacro"
    path.write_text('<r xmlns:xacro="http://www.ros.org/wiki/xacro">${"a" * 10**10}</r>')
    result = ws(*command, path)
    assert result.returncode == 2
    assert re.fullmatch("xacro: .*robot.xacro: needs more than 1024 MiB of memory\n", result.stderr)


def test_callers_workspaces_are_left_out(ws, tmp_path):
    (tmp_path / "rospy.py").write_text("raise ImportError('a stranger')")
    fake = tmp_path / "bin/python3"
    fake.parent.mkdir()
    fake.write_text("#!/bin/sh\nexit 9\n")
    fake.chmod(0o755)
    stranger = str(tmp_path)
    names = ("PYTHONPATH", "PYTHONHOME", "CMAKE_PREFIX_PATH", "ROS_NAMESPACE", "VIRTUAL_ENV",
             "CONDA_PREFIX")  # fmt: skip
    code = "import os, rospy; print(*os.environ.values())"
    paths = {"PATH": f"{fake.parent}:/usr/bin:/bin", "LD_LIBRARY_PATH": f"{stranger}/lib"}
    strange = paths | dict.fromkeys(names, stranger)
    result = ws("python3", "-c", code, **strange)
    assert result.returncode == 0, result.stderr
    assert stranger not in result.stdout.replace(str(fake.parent), "")


def test_a_folder_in_the_root_is_no_reason_to_build(ws, root, tmp_path):
    """Trainings leave runs/ there; a build under a running one would take its files away."""
    folder = root / f"zz-{tmp_path.name}"
    folder.mkdir()
    try:
        result = ws("true")
    finally:
        folder.rmdir()
    assert result.returncode == 0
    assert "building" not in result.stderr


# --- the network -------------------------------------------------------------------------------


def test_loopback_is_the_default(ws):
    assert variable(ws, "ROS_IP") == "127.0.0.1"
    assert re.fullmatch(r"http://127\.0\.0\.1:2\d{4}", variable(ws, "ROS_MASTER_URI"))


@pytest.mark.parametrize(
    ("name", "environment", "value"),
    [
        ("ROS_IP", {"ROS_MASTER_URI": "http://localhost:11311"}, "127.0.0.1"),
        ("ROS_IP", {"ROS_MASTER_URI": "http://robot.example:11311"}, "-"),
        ("ROS_MASTER_URI", {"ROS_MASTER_URI": "http://robot.example:11311"}, None),
        ("ROS_HOSTNAME", {"ROS_HOSTNAME": "desk.example"}, None),
    ],
)
def test_the_users_network_stays(ws, name, environment, value):
    assert variable(ws, name, **environment) == (value or environment[name])


@pytest.mark.slow
def test_roscore_is_the_master_that_the_workspace_looks_for(ws, root, tmp_path):
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        uri = f"http://127.0.0.1:{probe.getsockname()[1]}"
    process = subprocess.Popen(
        [root / "ws", "roscore"], env={**os.environ, "ROS_MASTER_URI": uri, "ROS_LOG_DIR": str(tmp_path)}
    )
    try:
        deadline = time.monotonic() + 120.0
        while (nodes := ws("rosnode", "list", ROS_MASTER_URI=uri).stdout) != "/rosout\n":
            assert process.poll() is None and time.monotonic() < deadline, nodes
    finally:
        process.send_signal(signal.SIGINT)
        assert process.wait(60) == 0


# --- tests -------------------------------------------------------------------------------------


@pytest.mark.slow
def test_fast_leaves_out_what_takes_long(ws):
    paths = ["test/unit/project/test_ci.py", "test/unit/project/test_catkin_workspace.py"]
    result = ws("test", "--collect-only", "-q", "--fast", *paths, "test/ros/robot_envs")
    assert result.returncode == 0, result.stdout
    tests = [line.split("::")[0] for line in result.stdout.splitlines() if "::" in line]
    assert set(tests) == {"test/unit/project/test_ci.py"}
