"""The package builds in somebody's own catkin workspace, without ws, with Debian's Python."""

from __future__ import annotations

import os
import shutil
import site
import subprocess

import pytest

CATKIN_MAKE = ["/usr/bin/catkin_make", "-DPYTHON_EXECUTABLE=/usr/bin/python3"]
# Built once: the tests of a group run in one process.
pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("catkin")]
MODULES = (
    "import bullet_gazebo_msgs.srv, cartpole.tasks, robot_envs.robot, rl_workbench.cli,"
    " gazebo_msgs.srv, ros_utils, bullet_gazebo.control,"
    " controller_manager.controller_manager_interface, controller_manager_msgs.utils"
)


def run(command, workspace, **environment):
    """Run a command of a user who has installed PyPI's packages and sourced nothing."""
    result = subprocess.run(
        command,
        check=False,
        cwd=workspace,
        env={"PATH": "/usr/bin:/bin", "HOME": str(workspace)} | environment,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert result.returncode == 0, f"{result.stdout[-3000:]}\n{result.stderr[-3000:]}"
    return result


@pytest.fixture(scope="module")
def workspace(root, tmp_path_factory):
    workspace = tmp_path_factory.mktemp("catkin_ws")
    shutil.copytree(
        root,
        workspace / "src/cartpole",
        ignore=shutil.ignore_patterns(".*", "__pycache__", "companions", "runs"),
    )
    shutil.copytree(root / "companions", workspace / "src/companions")
    result = run([*CATKIN_MAKE, "install"], workspace)
    assert "CMake Warning" not in result.stderr, result.stderr
    return workspace


@pytest.mark.parametrize("space", ["devel", "install"])
def test_built_workspace(workspace, space):
    def inside(*command):
        # In a function of its own, because catkin's setup file looks at the caller's arguments.
        script = 'enter() { source "$1"; }; enter "$0/setup.bash"; PYTHONPATH+=:$PYPI; exec "$@"'
        packages = os.pathsep.join(site.getsitepackages()[:1])
        return run(["bash", "-c", script, space, *command], workspace, PYPI=packages)

    assert "--episodes" in inside("rosrun", "cartpole", "pg_train.py", "--help").stdout
    inside("/usr/bin/python3", "-c", MODULES)
    for package in ("cartpole", "cartpole_gazebo", "cartpole_controller", "gazebo_ros"):
        found = inside("rospack", "find", package).stdout.strip()
        expected = workspace / ("install/share" if space == "install" else "src")
        assert found.startswith(str(expected))
    inside("roslaunch", "--files", "gazebo_ros", "empty_world.launch")


@pytest.mark.parametrize("space", ["devel", "install"])
def test_scripts_have_the_builds_interpreter(workspace, space):
    folders = [*(workspace / space / "lib").glob("*"), workspace / space / "bin"]
    found = [path for folder in folders for path in folder.glob("*")]
    scripts = [path for path in found if path.is_file() and os.access(path, os.X_OK)]
    ours = {"gz", "gzserver", "gzclient", "spawner", "unspawner"}
    ours |= {"controller_manager", "controller_group"}
    assert ours <= {each.name for each in scripts}
    for script in scripts:
        assert script.read_text().startswith("#!/usr/bin/python3\n"), script
