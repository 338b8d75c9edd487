"""The package in a user's own catkin workspace: the commands of docs/catkin.md, unchanged."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import signal
import socket
import subprocess
import sys
import sysconfig
import time
from pathlib import Path

import pytest
import rosgraph
from support.python import run

pytestmark = pytest.mark.slow
ROOT = Path(__file__).resolve().parents[3]
PAGE = ROOT / "docs/catkin.md"
SERVICE = "/gazebo/get_world_properties"
PACKAGES = sysconfig.get_path("purelib")
INSTALLED = Path(sys.prefix).parent / "base.txt"  # requirements/base.txt without what Debian has
# Debian 12's catkin doesn't look at it.
UNUSED = r"CMake Warning:\s+Manually-specified variables.*\s+Python_EXECUTABLE\s"
MODULES = (
    "import bullet_gazebo_msgs.srv, cartpole.tasks, robot_envs.robot, rl_workbench.cli,"
    " gazebo_msgs.srv, ros_utils, robot_sim.control,"
    " controller_manager.controller_manager_interface, controller_manager_msgs.utils"
)


def blocks() -> list[str]:
    return re.findall(r"^```sh\n(.*?)^```$", PAGE.read_text(), re.MULTILINE | re.DOTALL)


class Workspace:
    """A user's home with a catkin workspace, and a master's port of its own."""

    def __init__(self, home: Path) -> None:
        self.home, self.path = home, home / "catkin_ws"
        self.python = self.path / "venv/bin/python3"
        with socket.create_server(("127.0.0.1", 0)) as free:
            port = free.getsockname()[1]
        self.environment = {
            "PATH": "/usr/bin:/bin", "HOME": str(home), "OMP_NUM_THREADS": "1",
            "ROS_MASTER_URI": f"http://127.0.0.1:{port}", "ROS_IP": "127.0.0.1",
            "ROS_LANG_DISABLE": "gencpp:genlisp",  # nothing here needs these, and they take most time
            **{name: value for name, value in os.environ.items() if name.startswith("PIP_")},
        }  # fmt: skip

    def bash(self, script: str, *arguments: str) -> subprocess.CompletedProcess[str]:
        command = ["bash", "-ec", script, "bash", *arguments]
        return run(command, cwd=self.home, env=self.environment, timeout=600)

    def inside(self, *command: str, space: str = "devel") -> subprocess.CompletedProcess[str]:
        # In a function of its own, because catkin's setup file looks at the caller's arguments.
        enter = f"enter() {{ source {self.path}/{space}/setup.bash; }}; enter"
        return self.bash(f'{enter}; exec "$@"', *command)


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    """Made by the commands of the page, but for Debian's packages, which are there.

    The Python packages aren't fetched again: a .pth file shows those of this workspace's environment,
    where pip finds them installed. catkin_make installs as well, in the call that builds.
    """
    workspace = Workspace(tmp_path_factory.mktemp("home"))
    sources = workspace.home / "repository"
    ignored = shutil.ignore_patterns(".git", ".ws", "__pycache__", "runs")
    shutil.copytree(ROOT, sources, ignore=ignored)
    shutil.copy(INSTALLED, sources / "requirements")
    made = workspace.bash(
        f"cd {sources}; git init -q; git add -A; git -c user.name=a -c user.email=a@example.com commit -qm a"
    )
    assert made.returncode == 0, made.stderr
    script = "".join(blocks()[1:3]).replace("<this repository>", str(sources))
    assert script.splitlines()[-1].startswith("catkin_make ")
    script = f"{script.rstrip()} install\n"
    pip = "venv/bin/pip install"
    assert pip in script
    shown = f"echo {PACKAGES} > $(echo venv/lib/python3*/site-packages)/shown.pth\n"
    built = workspace.bash(script.replace(pip, f"{shown}{pip}"))
    assert built.returncode == 0, f"{built.stdout[-3000:]}\n{built.stderr[-3000:]}"
    warnings = re.sub(UNUSED, "", built.stderr)
    assert "CMake Warning" not in warnings, warnings
    fetched = re.findall(
        r"(\S+)-[0-9.]+", "".join(re.findall(r"(?m)^Successfully installed .*$", built.stdout))
    )
    assert set(fetched) <= {"setuptools"}, "it is every environment's own"
    return workspace


def is_offered(workspace: Workspace, service: str) -> bool:
    master = rosgraph.Master("/test", workspace.environment["ROS_MASTER_URI"])
    try:
        return bool(master.lookupService(service))
    except (OSError, rosgraph.MasterException):
        return False


def test_what_the_page_starts_then(workspace: Workspace) -> None:
    source, rosrun, roslaunch = blocks()[3].splitlines()
    trained = workspace.bash(f"{source}\n{rosrun}")
    assert trained.returncode == 0, trained.stdout + trained.stderr
    assert (workspace.home / "first/summary.json").is_file()

    with subprocess.Popen(
        ["bash", "-ec", f"{source}\nexec {roslaunch}"], cwd=workspace.home, env=workspace.environment,
        stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
    ) as launched:  # fmt: skip
        try:
            while launched.poll() is None and not is_offered(workspace, SERVICE):
                time.sleep(0.1)
            asked = workspace.inside("rosservice", "call", SERVICE)
        finally:
            launched.send_signal(signal.SIGINT)
            printed, _ = launched.communicate(timeout=120)
    assert "success: True" in asked.stdout, printed


@pytest.mark.parametrize("space", ["devel", "install"])
def test_built_workspace(workspace: Workspace, space: str) -> None:
    helped = workspace.inside("rosrun", "cartpole", "pg_train.py", "--help", space=space)
    assert "--episodes" in helped.stdout, helped.stderr
    imported = workspace.inside(str(workspace.python), "-c", MODULES, space=space)
    assert imported.returncode == 0, imported.stderr
    for package in ("cartpole", "cartpole_gazebo", "cartpole_controller", "gazebo_ros"):
        found = workspace.inside("rospack", "find", package, space=space).stdout.strip()
        expected = workspace.path / ("install/share" if space == "install" else "src")
        assert found.startswith(str(expected))
    launch = ("roslaunch", "--files", "gazebo_ros", "empty_world.launch")
    listed = workspace.inside(*launch, space=space)
    assert listed.returncode == 0, listed.stderr


@pytest.fixture
def bare(workspace: Workspace):
    """The same workspace, for somebody who has left out pip's step."""
    (shown,) = (workspace.path / "venv").glob("lib/python3*/site-packages/shown.pth")
    hidden = shown.rename(shown.with_suffix(".hidden"))
    yield workspace
    hidden.rename(shown)


@pytest.mark.parametrize("space", ["devel", "install"])
@pytest.mark.parametrize(
    ("package", "program", "missing"),
    [
        ("gazebo_ros", "gzserver", "collada, manifold3d, pybullet, trimesh, xacro"),
        ("cartpole", "pg_train.py", "gymnasium, matplotlib, pygame, tensorboard"),
        ("xacro", "xacro", "xacro"),
    ],
)
def test_missing_packages_are_one_line(
    bare: Workspace, space: str, package: str, program: str, missing: str
) -> None:
    ended = bare.inside("rosrun", package, program, space=space)
    assert (ended.returncode, ended.stdout) == (1, "")
    (line,) = ended.stderr.splitlines()
    told = re.fullmatch(
        rf"{program}: Python packages are missing \((.*)\); what installs them: (.*) \(see .*\)", line
    )
    assert set(missing.split(", ")) <= set(told[1].split(", "))
    python, *arguments, file = shlex.split(told[2])
    assert python == str(bare.python)
    assert arguments == ["-m", "pip", "install", "--requirement"]
    expected = "install/share/cartpole" if space == "install" else "src/cartpole"
    assert Path(file).resolve() == (bare.path / expected / "requirements/base.txt").resolve()
