"""What programs need of requirements/base.txt, and what they say where it is missing."""

from __future__ import annotations

import importlib.util
import os
import re
import shlex
import subprocess
import sys
import sysconfig
from importlib import metadata
from pathlib import Path

import pytest
from packaging.requirements import Requirement

from ros_calls.requirements import ALL, SIMULATOR

ROOT = Path(__file__).resolve().parents[3]
SRC = ROOT / "src"
INSTALLED = Path(sys.prefix).parent / "base.txt"  # requirements/base.txt without what Debian has
STARTED = "\n".join(
    [
        "import sys, bullet_gazebo.node.gzserver",
        "from robot_sim.physics.engines import make_engine",
        "import robot_sim.physics.files.mesh_program",
        "make_engine()",
        "print(*sys.modules)",
    ]
)


def distributions() -> dict[str, set[str]]:
    """The modules of each package that requirements/base.txt names for this machine."""
    lines = (ROOT / "requirements/base.txt").read_text().splitlines()
    needed = [Requirement(text) for line in lines if (text := line.partition("#")[0].strip())]
    names = [each.name.lower() for each in needed if not each.marker or each.marker.evaluate()]
    # Python 3.11 doesn't see a module that is a single compiled file: it has its package's name.
    modules = {name: {name} for name in names}
    for module, owners in metadata.packages_distributions().items():
        for owner in owners:
            if owner.lower() in modules:
                modules[owner.lower()].add(module)
    return modules


def test_every_package_is_asked_for() -> None:
    modules = distributions()
    assert len(modules) > 10
    assert [name for name, each in modules.items() if not each & set(ALL)] == []
    assert [name for name in ALL if importlib.util.find_spec(name) is None] == []


def test_the_simulator_is_asked_for_what_it_loads() -> None:
    command = [sys.executable, "-c", STARTED]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    loaded = {name.partition(".")[0] for name in done.stdout.split()}
    assert loaded & set(ALL) <= set(SIMULATOR)


def test_debians_python_is_told_how_to_install(tmp_path: Path) -> None:
    code = (
        f"import sys; sys.path.insert(0, {str(SRC)!r}); sys.argv = ['/x/program'];"
        "from ros_calls.requirements import require; require(('yaml', 'no_such_module', 'json'))"
    )
    ended = subprocess.run(
        ["/usr/bin/python3", "-c", code], env={"PATH": "/usr/bin"}, capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    assert ended.returncode == 1
    told = re.fullmatch(
        r"program: Python packages are missing \(no_such_module\); what installs them: (.*)"
        r" \((?:or in a virtual environment:|see) docs/catkin.md\)\n",
        ended.stderr,
    )
    python, *arguments, file = shlex.split(told[1])
    assert (python, file) == ("/usr/bin/python3", str(ROOT / "requirements/base.txt"))
    managed = Path(sysconfig.get_path("stdlib"), "EXTERNALLY-MANAGED").exists()
    flags = ["--break-system-packages"] if managed else []
    assert arguments == ["-m", "pip", "install", *flags, "--requirement"]


@pytest.mark.slow
def test_the_command_is_one_that_pip_takes() -> None:
    """In an environment that has them all, where there is nothing to fetch."""
    code = "import sys; from ros_calls.requirements import require; require(('no_such_module',))"
    command = [sys.executable, "-c", code]
    ended = subprocess.run(command, capture_output=True, text=True, check=False)
    *command, _file = shlex.split(re.search(r"installs them: (.*) \(see", ended.stderr)[1])
    done = subprocess.run(
        [*command, INSTALLED, "--dry-run", "--no-index"], capture_output=True, text=True, check=False,
        env={**os.environ, "PIP_DISABLE_PIP_VERSION_CHECK": "1"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "Would install" not in done.stdout
