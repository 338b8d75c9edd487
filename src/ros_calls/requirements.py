"""The packages of requirements/base.txt that a program needs, and the command that installs them.

Programs call it before they import anything else: in a user's own catkin workspace, rosdep and `catkin_make`
don't install what only pip has.
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
ALL = (
    *WINDOW,
    "gymnasium",
    "imageio_ffmpeg",
    "matplotlib",
    "psutil",
    "pygame",
    "tensorboard",
    "torch",
    "tqdm",
)


def require(modules: tuple[str, ...]) -> None:
    """Ends the program, with one line that says how to install what is missing.

    Raises:
        SystemExit: if one of the modules is missing.
    """
    text = lack(modules)
    if text:
        sys.exit(f"{Path(sys.argv[0]).name}: {text}")


def lack(modules: tuple[str, ...]) -> str:
    """Returns one line that names the missing modules and what installs them; empty if none is missing."""
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
    """Returns whether pip refuses to install beside the system's packages (PEP 668)."""
    return (
        sys.prefix == sys.base_prefix
        and Path(sysconfig.get_path("stdlib"), "EXTERNALLY-MANAGED").exists()
    )


def _file() -> Path:
    """Returns the list of packages: in the source tree, or where catkin has installed it."""
    here = Path(__file__).resolve()
    for above in here.parents:
        for place in (above / FILE, above / "share/cartpole" / FILE):
            if place.is_file():
                return place
    return Path(FILE)
