"""Expands robot descriptions (xacro) and puts them on the parameter server."""

import re
from collections.abc import Sequence

from file_access.expansion import CannotExpand as _CannotExpand
from file_access.expansion import expand as _expand
from ros_calls import master as _master
from ros_utils._internal import log as _log
from ros_utils._internal import packages as _packages
from ros_utils._internal import params as _params


def urdf_parse_from_pkg(
    pkg_name: str, model_name: str, folder: str = "/urdf", args_xacro: Sequence[str] | None = None
) -> str | None:
    """Expands a package's URDF or xacro file.

    Returns:
        The XML text, or None, with an error in the log, if the package or file is missing or the
        file is broken.
    """
    try:
        path = _packages.file(pkg_name, folder, model_name)
    except _packages.NotFound as fault:
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
        return _expand(_packages.existing(model_path), mappings)
    except (_packages.NotFound, _CannotExpand) as fault:
        _log.error(f"urdf: {fault}")
        return None


def urdf_load_from_pkg(
    pkg_name: str,
    model_name: str,
    param_name: str,
    folder: str = "/urdf",
    ns: str | None = None,
    args_xacro: Sequence[str] | None = None,
) -> bool:
    """Expands a package's URDF or xacro file and sets it as a parameter.

    Args:
        pkg_name: ROS package.
        model_name: the file's name.
        param_name: parameter to set, in `ns`; relative to the node's namespace if `ns` is None or
            "/".
        folder: the file's folder in the package.
        ns: namespace of the parameter.
        args_xacro: xacro arguments, ``"name:=value"`` each.

    Returns:
        True if the parameter was set. False, with an error in the log, if the package or file is
        missing, the file is broken, or no master answers.
    """
    xml = urdf_parse_from_pkg(pkg_name, model_name, folder, args_xacro)
    return xml is not None and _load(xml, param_name, ns)


def urdf_load_from_path(
    model_path: str, param_name: str, ns: str | None = None, args_xacro: Sequence[str] | None = None
) -> bool:
    """Expands a URDF or xacro file and sets it as a parameter. See `urdf_load_from_pkg`."""
    xml = urdf_parse_from_path(model_path, args_xacro)
    return xml is not None and _load(xml, param_name, ns)


def _load(xml: str, param_name: str, ns: str | None) -> bool:
    name = param_name if ns in (None, "", "/") else f"{ns}/{param_name}"
    try:
        _params.put(name, xml)
    except _master.MasterDown as fault:
        _log.error(f"parameter {name}: {fault}")
        return False
    return True
