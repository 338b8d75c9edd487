"""`ws`, the one entry: called as a user calls it, from a copy where it would do harm."""

from __future__ import annotations

import os
import re
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

PROBE = "import os, sys; print(os.environ.get(sys.argv[1], '-'))"


def variable(ws, name, **environment):
    return ws("python3", "-c", PROBE, name, **environment).stdout.strip()


# --- the command line --------------------------------------------------------------------------


@pytest.mark.parametrize("option", ["--help", "-h", "help"])
def test_help(ws, option):
    result = ws(option)
    assert result.returncode == 0
    for word in (
        "--with FOLDER",
        "test --fast",
        "check",
        "shell",
        "clean",
        "ROS_MASTER_URI",
        "http://127.0.0.1:2",
    ):
        assert word in result.stdout


def test_without_command_is_a_usage_error(ws):
    result = ws()
    assert result.returncode != 0
    assert "usage: ws CMD" in result.stdout


def test_unknown_option(ws):
    result = ws("--nonsense")
    assert result.returncode == 2
    assert "--nonsense" in result.stderr


def test_unknown_command(ws):
    result = ws("no-such-command")
    assert result.returncode == 127
    assert "no-such-command" in result.stderr


@pytest.mark.parametrize("code", [0, 3, 255])
def test_exit_code(ws, code):
    assert ws("python3", "-c", f"raise SystemExit({code})").returncode == code


def test_signal_reaches_the_command(ws, root):
    process = subprocess.Popen(
        [root / "ws", "python3", "-c", "import signal; print('up', flush=True); signal.pause()"],
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdout.readline() == "up\n"
    process.send_signal(signal.SIGTERM)
    assert process.wait(60) == -signal.SIGTERM
    process.stdout.close()


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


@pytest.mark.parametrize("name", ["python", "python3"])
def test_interpreter_is_the_workspaces(ws, root, name):
    result = ws(name, "-c", "import sys; print(sys.prefix)")
    assert Path(result.stdout.strip()).resolve() == root / ".ws/venv"


def test_imports(ws):
    code = "import rospy, pybullet, torch, gazebo_msgs.srv, bullet_gazebo_msgs.srv, ros_utils, bullet_gazebo"
    result = ws("python3", "-c", code)
    assert result.returncode == 0, result.stderr


def test_generated_and_written_modules_of_cartpole(ws):
    code = "import bullet_gazebo_msgs.srv, cartpole; print(cartpole.__doc__ is not None)"
    assert ws("python3", "-c", code).stdout.strip() == "True"


@pytest.mark.parametrize(
    "command",
    [
        ("rospack", "find", "cartpole"),
        ("roslaunch", "--files", "gazebo_ros", "empty_world.launch"),
        ("rosservice", "list", "--help"),
        ("rostest", "--help"),
        ("rosmsg", "show", "gazebo_msgs/ModelStates"),
        ("rossrv", "show", "bullet_gazebo_msgs/StepWorld"),
        ("catkin_find", "cartpole", "--share"),
    ],
    ids=" ".join,
)
def test_ros_commands(ws, command):
    result = ws(*command)
    assert result.returncode == 0, result.stderr
    assert result.stdout.strip()


def test_rosrun_finds_one_executable(ws, root):
    result = ws("rosrun", "xacro", "xacro", root / "urdf/cartpole.urdf.xacro")
    assert result.returncode == 0, result.stderr
    assert "stand_cart" in result.stdout


@pytest.mark.parametrize("command", [("xacro",), ("rosrun", "xacro", "xacro")])
def test_xacro_is_the_one_with_limits(ws, tmp_path, command):
    path = tmp_path / "robot.xacro"
    path.write_text('<r xmlns:xacro="http://www.ros.org/wiki/xacro">${"a" * 10**10}</r>')
    result = ws(*command, path)
    assert result.returncode == 2
    assert re.fullmatch("xacro: .*robot.xacro: needs more than 1024 MiB of memory\n", result.stderr)


def test_xacro_knows_packages(ws, root):
    robot = root / "companions/cartpole_gazebo/robots/cartpole_v1.urdf"
    result = ws("xacro", robot)
    assert result.returncode == 0, result.stderr
    assert "stand_cart" in result.stdout


def test_callers_workspaces_are_left_out(ws, tmp_path):
    (tmp_path / "rospy.py").write_text("raise ImportError('a stranger')")
    fake = tmp_path / "bin/python3"
    fake.parent.mkdir()
    fake.write_text("#!/bin/sh\nexit 9\n")
    fake.chmod(0o755)
    stranger = str(tmp_path)
    result = ws(
        "python3",
        "-c",
        "import os, rospy; print(*os.environ.values())",
        PATH=f"{fake.parent}:/usr/bin:/bin",
        PYTHONPATH=stranger,
        PYTHONHOME=stranger,
        CMAKE_PREFIX_PATH=stranger,
        ROS_NAMESPACE=stranger,
        LD_LIBRARY_PATH=f"{stranger}/lib",
        VIRTUAL_ENV=stranger,
        CONDA_PREFIX=stranger,
    )
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


def test_without_home(ws):
    assert ws("python3", "-c", "import matplotlib, rospy", HOME=None).returncode == 0


def test_everything_lies_in_one_folder(ws, root):
    for name in ("ROS_HOME", "ROS_LOG_DIR", "MPLCONFIGDIR"):
        assert Path(variable(ws, name)).resolve().is_relative_to(root / ".ws")


# --- the network -------------------------------------------------------------------------------


def test_loopback_is_the_default(ws):
    assert variable(ws, "ROS_IP") == "127.0.0.1"
    host, _, port = variable(ws, "ROS_MASTER_URI").rpartition(":")
    assert host == "http://127.0.0.1"
    assert 20000 <= int(port) < 30000


def test_a_local_master_keeps_loopback(ws):
    assert variable(ws, "ROS_IP", ROS_MASTER_URI="http://localhost:11311") == "127.0.0.1"


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("ROS_MASTER_URI", "http://robot.example:11311"),
        ("ROS_IP", "192.0.2.7"),
        ("ROS_HOSTNAME", "desk.example"),
    ],
)
def test_users_network_stays(ws, name, value):
    assert variable(ws, name, **{name: value}) == value


def test_a_remote_master_gets_no_loopback_address(ws):
    assert variable(ws, "ROS_IP", ROS_MASTER_URI="http://robot.example:11311") == "-"


def test_roscore_is_the_master_that_the_workspace_looks_for(ws, root, tmp_path):
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        uri = f"http://127.0.0.1:{probe.getsockname()[1]}"
    with (tmp_path / "log").open("w+") as log:
        process = subprocess.Popen(
            [root / "ws", "roscore"],
            stdout=log, stderr=log,
            env={**os.environ, "ROS_MASTER_URI": uri, "ROS_LOG_DIR": str(tmp_path)},
        )  # fmt: skip
        try:
            while "started core service" not in (tmp_path / "log").read_text():
                assert process.poll() is None
                time.sleep(0.1)
            assert ws("rosnode", "list", ROS_MASTER_URI=uri).stdout == "/rosout\n"
        finally:
            process.send_signal(signal.SIGINT)
            assert process.wait(60) == 0


# --- tests and checks --------------------------------------------------------------------------


def test_fast_leaves_out_what_takes_long(ws):
    files = ["test_rostest_plugin.py", "test_ci.py", "test_catkin_workspace.py"]
    paths = [f"test/unit/project/{name}" for name in files]
    result = ws("test", "--collect-only", "-q", "--fast", *paths, "test/ros/robot_envs")
    assert result.returncode == 0, result.stdout
    tests = [line.split("::")[0] for line in result.stdout.splitlines() if "::" in line]
    assert set(tests) == {"test/unit/project/test_ci.py"}


def test_an_unknown_check_is_a_usage_error(ws):
    result = ws("check", "nonsense")
    assert result.returncode == 2
    assert "no check 'nonsense', only lint format types" in result.stderr


def test_the_tests_run_in_the_workspace(root):
    assert Path(sys.prefix).resolve() == root / ".ws/venv"
