"""Package lookup, and expansion of robot descriptions (xacro)."""

import os
import re
from collections.abc import Sequence

import rospkg

from file_access.expansion import CannotExpand, expand
from ros_utils._internal import log as _log


class NotFound(Exception):
    """No such package or file; the text says which, and where the search looked."""


def folder(package: str) -> str:
    """Returns the folder of a ROS package; raises NotFound if there is none."""
    try:
        return str(rospkg.RosPack().get_path(package))
    except rospkg.ResourceNotFound as fault:
        raise NotFound(
            f"package '{package}' not found: is its workspace sourced (ROS_PACKAGE_PATH)?"
        ) from fault


def file(package: str, subfolder: str, name: str) -> str:
    """Returns the path of a file in a package's subfolder; raises NotFound if there is none."""
    return existing(os.path.join(folder(package), subfolder.strip("/"), name))


def existing(path: str) -> str:
    """Returns the path itself; raises NotFound if it is not a file."""
    if not os.path.isfile(path):
        raise NotFound(f"{path}: no such file")
    return path


def urdf_parse_from_pkg(
    pkg_name: str, model_name: str, folder: str = "/urdf", args_xacro: Sequence[str] | None = None
) -> str | None:
    """Expands a package's URDF or xacro file.

    Returns the XML text, or None, with an error in the log, if the package or file is missing or the file is
    broken.
    """
    try:
        path = file(pkg_name, folder, model_name)
    except NotFound as fault:
        _log.error(f"urdf: {fault}")
        return None
    return urdf_parse_from_path(path, args_xacro)


def urdf_parse_from_path(model_path: str, args_xacro: Sequence[str] | None = None) -> str | None:
    """Expands a URDF or xacro file, given by its path. See `urdf_parse_from_pkg`."""
    mappings = {}
    for argument in args_xacro or []:
        name, sign, value = argument.partition(":=")
        if not sign or not re.fullmatch(r"\w+", name):
            _log.error(f"urdf: xacro argument {argument!r}: expected 'name:=value'")
            return None
        mappings[name] = value
    try:
        return expand(existing(model_path), mappings)
    except (NotFound, CannotExpand) as fault:
        _log.error(f"urdf: {fault}")
        return None
