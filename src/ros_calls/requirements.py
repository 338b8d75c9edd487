"""Check for the packages of requirements/base.txt, with the command that installs missing ones.

Programs call it before any other import: in a user's own catkin workspace, rosdep and `catkin_make` don't
install packages that only pip has.
"""

import importlib.util
import platform
import shlex
import sys
import sysconfig
from pathlib import Path

FILE = "requirements/base.txt"
PAGE = "docs/catkin.md"

# For the simulator (physics, meshes of all kinds), for its window, and for all programs. Elsewhere PyBullet
# and embreex have no wheels.
PHYSICS = ("embreex", "pybullet") if platform.machine() == "x86_64" else ("mujoco",)
SIMULATOR = (
    *PHYSICS, "collada", "manifold3d", "msgpack", "numpy", "psutil", "trimesh", "vhacdx", "xacro", "yaml",
)  # fmt: skip
WINDOW = (*SIMULATOR, "PIL", "viser", "websockets")
ALL = (*WINDOW, "gymnasium", "jinja2", "matplotlib", "pygame", "tensorboard", "torch", "tqdm")


def require(modules: tuple[str, ...]) -> None:
    """Ends the program if modules are missing, with one line that says how to install them.

    Raises:
        SystemExit: A module is missing.
    """
    text = lack(modules)
    if text:
        sys.exit(f"{Path(sys.argv[0]).name}: {text}")


def lack(modules: tuple[str, ...]) -> str:
    """Returns a line with the missing modules and the install command; empty if none is missing."""
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
    """Returns whether pip refuses to install into the system's Python (PEP 668)."""
    return sys.prefix == sys.base_prefix and Path(sysconfig.get_path("stdlib"), "EXTERNALLY-MANAGED").exists()


def _file() -> Path:
    """Returns the path of the package list, in the source tree or where catkin installed it."""
    here = Path(__file__).resolve()
    for above in here.parents:
        for place in (above / FILE, above / "share/cartpole" / FILE):
            if place.is_file():
                return place
    return Path(FILE)
