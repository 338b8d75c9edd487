"""What `ws` takes from the system: its Python's lock file, Debian's torch, ROS 1."""

from __future__ import annotations

from pathlib import Path

import pytest
from support.python import run

STEPS = """set -euo pipefail
ROOT=$PWD VENV=none WS={folder}
source tools/ws_steps.sh
python_version() {{ echo {version}; }}
{code}
"""


@pytest.fixture
def steps(root, tmp_path):
    """Returns a function that runs code with the functions of ws_steps.sh; returns what it prints."""

    def printed(code, version="3.13", **environment):
        script = STEPS.format(folder=tmp_path, version=version, code=code)
        environment = {"PATH": "/usr/bin:/bin"} | environment
        return run(["bash", "-c", script], cwd=root, check=True, env=environment).stdout

    return printed


def test_debian_13_has_a_torch_of_its_own(steps):
    code = "debian_list debian.txt; list_of base.txt; list_of extras.txt"
    debian_12, debian_13 = (steps(f"SYSTEM='debian {version}'; {code}") for version in (12, 13))
    pins = ("\ntorch==", "\nstable-baselines3==")  # this asks for a newer torch than Debian's
    assert "python3-torch" in debian_13 and not any(pin in debian_13 for pin in pins)
    assert "python3-torch" not in debian_12 and all(pin in debian_12 for pin in pins)
    assert steps(f"SYSTEM='debian 13'; {code}", CARTPOLE_TORCH="pip") == debian_12


@pytest.mark.parametrize("version", ["3.11", "3.12", "3.13"])
def test_a_lock_file_pins_all_that_the_lists_name(steps, root, version):
    lock = Path(steps("lock_file", version).strip()).read_text()
    files = (root / f"requirements/{name}.txt" for name in ("base", "test", "extras", "docs"))
    lines = "".join(file.read_text() for file in files).splitlines()
    pins = {line.split()[0].rstrip(";") for line in lines if "==" in line.split("#")[0]}
    other = "pybullet==3.2.7" if version > "3.11" else "pybullet-arm64==3.2.8"
    assert {pin for pin in pins if not pin.startswith("torch")} - set(lock.splitlines()) == {other}
    assert "torch==" not in lock and "nvidia" not in lock


def test_a_python_without_a_lock_file_is_named(steps):
    told = steps("pip_install || echo $?", "3.10").splitlines()
    assert told[0].startswith("ERROR: requirements/ has no lock file for Python 3.10, only ")
    assert told[1:] == ["1"]


@pytest.fixture
def one(tmp_path):
    """A ROS outside of Debian's places, as Ubuntu 24.04 has it."""
    folder = tmp_path / "opt/ros/one"
    (folder / "share/rospy").mkdir(parents=True)
    (folder / "setup.bash").touch()
    return folder


@pytest.mark.parametrize(
    ("system", "sourced", "found"),
    [
        ("ID=ubuntu", True, "sourced"),
        ("ID=ubuntu", False, "opt/ros/one"),
        ("ID=debian", True, ""),  # Debian's rospy is the one that is tested
    ],
)
def test_which_ros_is_taken(steps, one, tmp_path, system, sourced, found):
    (tmp_path / "os-release").write_text(f"NAME=x\n{system}\nID_LIKE=debian\n")
    (tmp_path / "sourced/share/rospy").mkdir(parents=True)
    (tmp_path / "sourced/setup.bash").touch()
    path = {"CMAKE_PREFIX_PATH": f"{tmp_path}/overlay:{tmp_path}/sourced"} if sourced else {}
    code = f"look_at_system {tmp_path}/os-release {one}; echo $ROS_PREFIX; debian_list debian.txt"
    prefix, *packages = steps(code, "3.12", **path).splitlines()
    assert prefix == (str(tmp_path / found) if found else "")
    assert ("ros-core" in packages) == (not found) and "python3-venv" in packages


def test_without_any_ros_debians_packages_are_asked_for(steps, tmp_path):
    code = f"look_at_system /none {tmp_path}/none; echo $ROS_PREFIX; debian_list debian.txt"
    assert steps(code, "3.12").startswith("\n") and "ros-core" in steps(code, "3.12")
