"""The packages of requirements/base.txt that a program needs, and the command that installs them.

For programs alone, before they import anything else: in somebody's own catkin workspace nobody has installed
what rosdep and `catkin_make` don't.
"""

from __future__ import annotations

import importlib.util
import shlex
import sys
import sysconfig
from pathlib import Path

FILE = "requirements/base.txt"
PAGE = "docs/catkin.md"

# What the simulator runs on, PyBullet's engine with meshes of all kinds; its window; and all programs.
SIMULATOR = ("collada", "numpy", "pybullet", "scipy", "trimesh", "xacro", "yaml")
WINDOW = (*SIMULATOR, "PIL", "viser", "websockets")
ALL = (*WINDOW, "gymnasium", "matplotlib", "pygame", "tensorboard", "torch", "tqdm")


def require(modules: tuple[str, ...]) -> None:
    """Ends the program, with one line that says how to install what is missing.

    Raises:
        SystemExit: if one of the modules isn't there.
    """
    text = lack(modules)
    if text:
        sys.exit(f"{Path(sys.argv[0]).name}: {text}")


def lack(modules: tuple[str, ...]) -> str:
    """Returns one line that names the modules that are missing, and what installs them; empty if none is."""
    missing = [name for name in modules if importlib.util.find_spec(name) is None]
    if not missing:
        return ""
    command = [sys.executable, "-m", "pip", "install", "--requirement", str(_file())]
    if _is_managed():
        command.insert(4, "--break-system-packages")
        more = f"or in a virtual environment: {PAGE}"
    else:
        more = f"see {PAGE}"
    return (
        f"Python packages are missing ({', '.join(missing)}); what installs them: {shlex.join(command)}"
        f" ({more})"
    )


def _is_managed() -> bool:
    """Whether pip needs to be told to write beside the system's packages (PEP 668)."""
    return (
        sys.prefix == sys.base_prefix
        and Path(sysconfig.get_path("stdlib"), "EXTERNALLY-MANAGED").exists()
    )


def _file() -> Path:
    """The list of packages: in the sources, or where catkin has installed it."""
    here = Path(__file__).resolve()
    for above in here.parents:
        for place in (above / FILE, above / "share/cartpole" / FILE):
            if place.is_file():
                return place
    return Path(FILE)
