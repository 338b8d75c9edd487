"""Expands robot descriptions (xacro). Part of `ros_urdf` and `ros_gazebo`."""

from __future__ import annotations

import re
from collections.abc import Sequence

from file_access.expansion import CannotExpand, expand
from ros_utils._internal import log as _log
from ros_utils._internal import packages as _packages


class BadArgument(ValueError):
    """A xacro argument isn't of the form ``name:=value``; the text says which."""


def urdf_parse_from_pkg(
    pkg_name: str, model_name: str, folder: str = "/urdf", args_xacro: Sequence[str] | None = None
) -> str | None:
    """Expands a package's URDF or xacro file.

    Returns:
        The XML text, or None, with an error in the log, if the package or file is missing or the
        file is broken.
    """
    path = find("urdf_parse_from_pkg", pkg_name, folder, model_name)
    return None if path is None else urdf_parse_from_path(path, args_xacro)


def urdf_parse_from_path(model_path: str, args_xacro: Sequence[str] | None = None) -> str | None:
    """Expands a URDF or xacro file, given by its path. See `urdf_parse_from_pkg`."""
    try:
        mappings = dict(_mapping(argument) for argument in args_xacro or [])
        return expand(_packages.existing(model_path), mappings)
    except (_packages.NotFound, BadArgument, CannotExpand) as fault:
        _log.error(f"urdf: {fault}")
        return None


def find(caller: str, package: str, folder: str, name: str) -> str | None:
    """Returns the path of a package's file, or None with an error in the log that names `caller`."""
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
