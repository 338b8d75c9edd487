"""The robot's own files, found without a running ROS: its URDF and its controllers' parameters.

They lie in the source tree around this module or, once installed, where rospkg finds the packages.
"""

from functools import lru_cache
from pathlib import Path
from typing import Any

import xacro
import yaml

from cartpole.errors import CartpoleError

TREE = Path(__file__).resolve().parents[3]
ROBOT = ("cartpole", "urdf/cartpole.urdf.xacro")
CONTROLLERS = ("cartpole_controller", "config/joint_position_control.yaml")


@lru_cache(maxsize=1)
def robot_urdf() -> str:
    """The robot's URDF, written out as the parameter robot_description has it.

    Raises:
        CartpoleError: if the file isn't found.
    """
    return str(xacro.process_file(str(_path(*ROBOT))).toprettyxml(indent="  "))


def controller_parameters(name: str) -> dict[str, Any]:
    """The parameters `/<name>` of a controller.

    Raises:
        CartpoleError: if the file isn't found, or has no such controller.
    """
    path = _path(*CONTROLLERS)
    parameters = _read(path).get(name)
    if not isinstance(parameters, dict):
        raise CartpoleError(f"{path} has no controller '{name}'")
    return parameters


@lru_cache(maxsize=1)
def _read(path: Path) -> dict[str, Any]:
    return dict(yaml.safe_load(path.read_text(encoding="utf-8")))


def _path(package: str, place: str) -> Path:
    folder = TREE if package == "cartpole" else TREE / "companions" / package
    found = folder / place
    return found if found.is_file() else _package(package) / place


def _package(name: str) -> Path:
    import rospkg  # not needed within the source tree, which may be used without ROS

    try:
        return Path(rospkg.RosPack().get_path(name))
    except rospkg.ResourceNotFound as error:
        raise CartpoleError(
            f"package '{name}' is neither beside {TREE} nor on ROS_PACKAGE_PATH; "
            "source the workspace that it is installed in"
        ) from error
