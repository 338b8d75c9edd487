"""In-process work needs no ROS: the wheel trains in a plain virtual environment."""

from __future__ import annotations

import json
import os
import shutil
import sys
import sysconfig
import tomllib
import venv
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from support.python import run as run_command

pytestmark = pytest.mark.slow

SOURCES = ("src", "config", "urdf", "worlds", "companions", "requirements")
ROS = ("rospy", "roslib", "rosgraph", "rospkg", "catkin_pkg", "gazebo_msgs", "bullet_gazebo_msgs")


def run(*command: str | Path, cwd: Path, code: int = 0) -> str:
    """Runs a command of somebody who has sourced nothing; returns what it printed."""
    environment = {"PATH": "/usr/bin:/bin", "HOME": str(cwd), "OMP_NUM_THREADS": "1"}
    done = run_command(command, cwd=cwd, env=environment)
    printed = done.stderr + done.stdout
    assert done.returncode == code, printed[-3000:]
    return printed


def pip(python: Path, *arguments: str | Path, cwd: Path) -> None:
    # pip's own settings may say where packages come from, which counts here as everywhere else.
    settings = [f"{name}={value}" for name, value in os.environ.items() if name.startswith("PIP_")]
    options = ("--python", python, "--disable-pip-version-check")
    run("env", *settings, sys.executable, "-m", "pip", *options, *arguments, cwd=cwd)


def copy_sources(root: Path, sources: Path) -> None:
    sources.mkdir()
    for path in root.iterdir():
        if path.is_file():
            shutil.copy(path, sources)
    ignored = shutil.ignore_patterns("__pycache__", "*.egg-info")
    for name in SOURCES:
        shutil.copytree(root / name, sources / name, ignore=ignored)


@pytest.fixture(scope="module")
def wheel(root: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build(root, tmp_path_factory.mktemp("wheel") / "sources")  # a build leaves files behind


def build(root: Path, sources: Path, changed_at: float | None = None) -> Path:
    """The wheel of a copy of the sources, as changed at a time."""
    copy_sources(root, sources)
    for path in sources.rglob("*.py"):
        if changed_at is not None:
            os.utime(path, (changed_at, changed_at))
    pip(Path(sys.executable), "wheel", "--no-deps", "--wheel-dir", sources, sources, cwd=sources)
    (wheel,) = sources.glob("cartpole-*.whl")
    return wheel


@pytest.fixture(scope="module")
def python(wheel: Path) -> Path:
    """A plain virtual environment's Python, the wheel with all that it requires installed there.

    The heavy packages aren't fetched again: a .pth file shows those of the workspace's virtual
    environment, where pip finds them installed. It holds nothing of ROS, and none of ours.
    """
    folder = wheel.parents[1]
    venv.create(folder / "venv")  # pip in it would take seconds
    python = folder / "venv/bin/python3"
    packages = sysconfig.get_path("purelib")
    place = folder / "venv/lib" / Path(packages).parent.name / "site-packages"
    (place / "workspace.pth").write_text(packages)
    pip(python, "install", wheel, cwd=folder)
    return python


def test_there_is_no_ros(python: Path, tmp_path: Path) -> None:
    find = f"import importlib.util as u; print([n for n in {ROS} if u.find_spec(n)])"
    assert run(python, "-c", find, cwd=tmp_path) == "[]\n"


def test_all_libraries_come_from_the_wheel(python: Path, tmp_path: Path) -> None:
    code = "import cartpole, robot_envs, rl_workbench, robot_sim.simulator as s; print(cartpole, s)"
    printed = run(python, "-c", code, cwd=tmp_path)
    assert printed.count(str(python.parents[1] / "lib")) == 2


def as_in_the_workspace(python: Path, code: str, cwd: Path) -> str:
    """The last line that code prints in the wheel's environment, which is that of the workspace's."""
    ours = run(sys.executable, "-c", f"import sys; sys.path = {sys.path}; {code}", cwd=cwd)
    (*_, printed) = run(python, "-c", code, cwd=cwd).splitlines()
    assert printed == ours.splitlines()[-1]
    return printed


def test_the_robots_that_come_along_move_as_in_the_workspace(python: Path, tmp_path: Path) -> None:
    code = (
        "import cartpole, gymnasium, json, robot_envs.robots;"
        "ids = sorted(each for each in gymnasium.registry if each.startswith('robot_envs/'));"
        "envs = [gymnasium.make(each) for each in [*ids, 'cartpole/SwingUp-v0']];"
        "[env.reset(seed=0) for env in envs];"
        "steps = [env.step(env.action_space.sample() * 0.0 + 0.5) for env in envs * 5];"
        "print(json.dumps([' '.join(str(step[:2]).split()) for step in steps]))"
    )
    assert len(json.loads(as_in_the_workspace(python, code, tmp_path))) == 12 * 5


def test_a_package_of_ones_own_is_written(python: Path, tmp_path: Path) -> None:
    code = "from package_writing.cli import main; print(main(['my_arm', '--to', '.']))"
    assert run(python, "-c", code, cwd=tmp_path).splitlines()[-1] == "0"
    assert (tmp_path / "my_arm/urdf/two_link_arm.urdf.xacro").is_file()


def test_rl_workbench_trains(python: Path, tmp_path: Path) -> None:
    command = python.with_name("rl-workbench")
    robot = ["--env-id", "cartpole/Classic-v0"]
    flags = ["--total-timesteps", "200", "--eval-episodes", "1", "--run-dir", "run"]
    run(command, "train", "--algo", "dqn", *robot, *flags, cwd=tmp_path)
    summary = json.loads((tmp_path / "run/summary.json").read_text())
    assert summary["steps"] == 200


def test_what_needs_ros_says_so_in_one_line(python: Path, tmp_path: Path) -> None:
    command = (python.with_name("cartpole-pg"), "--backend", "ros", "--episodes", "1")
    printed = run(*command, cwd=tmp_path, code=1)
    assert printed.startswith("pg_train.py: the backend ros needs ROS")
    assert len(printed.splitlines()) == 1


def test_cartpole_pg_trains(python: Path, tmp_path: Path) -> None:
    command = python.with_name("cartpole-pg")
    run(command, "--episodes", "5", "--eval-episodes", "1", "--run-dir", "run", cwd=tmp_path)
    summary = json.loads((tmp_path / "run/summary.json").read_text())
    assert len(summary["lengths"]) == 5
    assert (tmp_path / "run/policy_network.pth").is_file()


@pytest.mark.parametrize("name", ["base", "extras", "docs"])
def test_what_is_pinned_lies_within_what_the_wheel_asks_for(root: Path, name: str) -> None:
    project = tomllib.loads((root / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"]
    texts = sum(extras.values(), project["dependencies"])
    ranges = {each.name: each.specifier for each in map(Requirement, texts)}
    lines = (root / f"requirements/{name}.txt").read_text().splitlines()
    pins = [Requirement(line.split("#")[0]) for line in lines if line.split("#")[0]]
    assert pins
    for pin in pins:
        (version,) = pin.specifier
        assert version.version in ranges[pin.name]


def test_a_wheel_is_the_same_bytes_each_time(root: Path, wheel: Path, tmp_path: Path) -> None:
    again = build(root, tmp_path / "sources", changed_at=1e9)
    assert again.read_bytes() == wheel.read_bytes()
