"""Expands robot descriptions (xacro) and puts them on the parameter server."""

from __future__ import annotations

import re
from collections.abc import Sequence

from files.expansion import CannotExpand, expand
from ros_calls import master as _master
from ros_utils._internal import log as _log
from ros_utils._internal import packages as _packages
from ros_utils._internal import params as _params

__all__ = [
    "urdf_load_from_path",
    "urdf_load_from_pkg",
    "urdf_parse_from_path",
    "urdf_parse_from_pkg",
]


def urdf_load_from_pkg(
    pkg_name: str,
    model_name: str,
    param_name: str,
    folder: str = "/urdf",
    ns: str | None = None,
    args_xacro: Sequence[str] | None = None,
) -> bool:
    """Expand a package's URDF or xacro file and set it as a parameter.

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
    path = _find("urdf_load_from_pkg", pkg_name, folder, model_name)
    return path is not None and urdf_load_from_path(path, param_name, ns, args_xacro)


def urdf_load_from_path(
    model_path: str, param_name: str, ns: str | None = None, args_xacro: Sequence[str] | None = None
) -> bool:
    """Expand a URDF or xacro file, given by its path, and set it as a parameter. See
    `urdf_load_from_pkg`."""
    xml = urdf_parse_from_path(model_path, args_xacro)
    if xml is None:
        return False
    name = param_name if ns in (None, "", "/") else f"{ns}/{param_name}"
    try:
        _params.put(name, xml)
    except _master.MasterDown as fault:
        _log.error(f"parameter {name}: {fault}")
        return False
    return True


class BadArgument(ValueError):
    """A xacro argument has another form; the text says which."""


def urdf_parse_from_pkg(
    pkg_name: str, model_name: str, folder: str = "/urdf", args_xacro: Sequence[str] | None = None
) -> str | None:
    """Expand a package's URDF or xacro file.

    Returns:
        The XML text, or None, with an error in the log, if the package or file is missing or the
        file is broken.
    """
    path = _find("urdf_parse_from_pkg", pkg_name, folder, model_name)
    return None if path is None else urdf_parse_from_path(path, args_xacro)


def urdf_parse_from_path(model_path: str, args_xacro: Sequence[str] | None = None) -> str | None:
    """Expand a URDF or xacro file, given by its path. See `urdf_parse_from_pkg`."""
    try:
        mappings = dict(_mapping(argument) for argument in args_xacro or [])
        return expand(_packages.existing(model_path), mappings)
    except (_packages.NotFound, BadArgument, CannotExpand) as fault:
        _log.error(f"urdf: {fault}")
        return None


def _find(caller: str, package: str, folder: str, name: str) -> str | None:
    """The path of a package's file, or None, with an error in the log that begins with `caller`."""
    try:
        return _packages.file(package, folder, name)
    except _packages.NotFound as fault:
        _log.error(f"{caller}: {fault}")
        return None


def _mapping(argument: str) -> tuple[str, str]:
    name, sign, value = argument.partition(":=")
    if not sign or not re.fullmatch(r"\w+", name):
        raise BadArgument(f"xacro argument {argument!r}: expected 'name:=value'")
    return name, value
