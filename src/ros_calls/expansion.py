"""Expand xacro files, within bounds of time and memory."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Mapping

from ros_calls import xacro_process

STARTING = 30.0  # [s] beyond the time limit, for Python to come up on a busy machine


class CannotExpand(Exception):
    """The file can't be expanded; the text is one line with the file, the place and the reason."""


def expand(
    path: str | os.PathLike[str],
    mappings: Mapping[str, str] | None = None,
    *,
    processor_time: int = xacro_process.PROCESSOR_TIME,
    wall_time: float = xacro_process.WALL_TIME,
    memory: int = xacro_process.MEMORY,
) -> str:
    """Expand a URDF or xacro file in a process of its own, with the xacro that this process would import.

    Args:
        path: the file, which may be plain XML.
        mappings: xacro arguments, name and value.
        processor_time: that it may take [s].
        wall_time: that it may take [s].
        memory: that it may take, address space [bytes].

    Returns:
        The XML text.

    Raises:
        CannotExpand: the file is broken or goes beyond a limit.
    """
    return _ask("xml", os.fspath(path), mappings, processor_time, wall_time, memory)


def included_files(
    path: str | os.PathLike[str], mappings: Mapping[str, str] | None = None
) -> list[str]:
    """The files that a xacro file includes, or takes numbers from, as it is expanded with these arguments.

    Raises:
        CannotExpand: the file is broken or goes beyond a limit of `expand`.
    """
    limits = xacro_process.PROCESSOR_TIME, xacro_process.WALL_TIME, xacro_process.MEMORY
    return _ask("files", os.fspath(path), mappings, *limits).splitlines()


def _ask(
    wanted: str,
    path: str,
    mappings: Mapping[str, str] | None,
    processor_time: int,
    wall_time: float,
    memory: int,
) -> str:
    request = {
        "wanted": wanted,
        "path": path,
        "mappings": dict(mappings or {}),
        "processor_time": processor_time,
        "wall_time": wall_time,
        "memory": memory,
        "sys_path": [os.path.abspath(entry) for entry in sys.path],
    }
    command = [sys.executable, "-I", xacro_process.__file__]
    try:
        done = subprocess.run(
            command,
            input=json.dumps(request).encode(),
            stdout=subprocess.PIPE,
            check=False,
            timeout=wall_time + STARTING,
        )
    except subprocess.TimeoutExpired as fault:
        raise CannotExpand(f"{path}: xacro: no answer within {fault.timeout:g} s") from fault
    except OSError as fault:
        raise CannotExpand(f"{path}: xacro can't be started: {fault.strerror}") from fault
    if done.returncode < 0:
        reason = xacro_process.ended_by(-done.returncode, processor_time, wall_time)
        raise CannotExpand(f"{path}: xacro: {reason}")
    if done.returncode:
        reason = done.stdout.decode(errors="replace")
        raise CannotExpand(reason or f"{path}: xacro: exit code {done.returncode}")
    return done.stdout.decode(errors="surrogateescape")
