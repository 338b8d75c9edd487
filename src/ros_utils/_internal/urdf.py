"""Expand robot descriptions (xacro). Part of `ros_urdf` and `ros_gazebo`."""

from __future__ import annotations

import re
import threading
from collections.abc import Sequence
from xml.parsers.expat import ExpatError

import xacro

from ros_utils._internal import log as _log
from ros_utils._internal import packages as _packages

_lock = threading.Lock()  # xacro keeps its state in module variables


class BrokenModel(Exception):
    """The file can't be expanded; the text gives the file, the place and what is wrong."""


def urdf_parse_from_pkg(
    pkg_name: str, model_name: str, folder: str = "/urdf", args_xacro: Sequence[str] | None = None
) -> str | None:
    """Expand a package's URDF or xacro file.

    Returns:
        The XML text, or None, with an error in the log, if the package or file is missing or the
        file is broken.
    """
    path = find("urdf_parse_from_pkg", pkg_name, folder, model_name)
    return None if path is None else urdf_parse_from_path(path, args_xacro)


def urdf_parse_from_path(model_path: str, args_xacro: Sequence[str] | None = None) -> str | None:
    """Expand a URDF or xacro file, given by its path. See `urdf_parse_from_pkg`."""
    try:
        return _expand(_packages.existing(model_path), args_xacro or [])
    except (_packages.NotFound, BrokenModel) as fault:
        _log.error(f"urdf: {fault}")
        return None


def find(caller: str, package: str, folder: str, name: str) -> str | None:
    """The path of a package's file, or None, with an error in the log that begins with `caller`."""
    try:
        return _packages.file(package, folder, name)
    except _packages.NotFound as fault:
        _log.error(f"{caller}: {fault}")
        return None


def _expand(path: str, arguments: Sequence[str]) -> str:
    mappings = dict(_mapping(argument) for argument in arguments)
    with _lock:
        try:
            return str(xacro.process_file(path, mappings=mappings).toprettyxml(indent="  "))
        except ExpatError as fault:
            raise BrokenModel(f"{_place(path)}: {fault}") from fault
        except Exception as fault:
            # xacro evaluates the file's own Python expressions: anything may come out.
            text = " ".join(str(fault.args[0] if isinstance(fault, KeyError) else fault).split())
            raise BrokenModel(f"{_place(path)}: {text or type(fault).__name__}") from fault


def _mapping(argument: str) -> tuple[str, str]:
    name, sign, value = argument.partition(":=")
    if not sign or not re.fullmatch(r"\w+", name):
        raise BrokenModel(f"xacro argument {argument!r}: expected 'name:=value'")
    return name, value


def _place(path: str) -> str:
    """The file that xacro was reading, with the files and macros that led there."""
    files = [str(file) for file in reversed(xacro.filestack or [path]) if file]
    macros = [macro.body.getAttribute("name") for macro in reversed(xacro.macrostack or [])]
    through = "".join(f", included from {file}" for file in files[1:])
    return files[0] + through + "".join(f", in macro {name}" for name in macros)
