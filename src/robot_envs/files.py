"""Reads a robot's files: its URDF, through xacro if it is one, and its controllers' parameters."""

from functools import lru_cache
from pathlib import Path
from typing import Any

from file_reading.content import read_file
from file_reading.errors import FileError
from file_reading.yaml_text import load_documents
from robot_envs.errors import RobotEnvError
from ros_calls.expansion import CannotExpand, expand


@lru_cache(maxsize=8)
def read_urdf(path: Path) -> str:
    """The URDF in a file, which may be a xacro file whatever its name.

    Raises:
        RobotEnvError: if it can't be read or expanded.
    """
    try:
        return expand(path)
    except CannotExpand as error:
        raise RobotEnvError(f"can't read {error}") from error


@lru_cache(maxsize=8)
def read_parameters(path: Path) -> dict[str, Any]:
    """A YAML file of parameters.

    Raises:
        RobotEnvError: if it can't be read.
    """
    try:
        documents = load_documents(read_file(path))
    except FileError as error:
        raise RobotEnvError(f"{path}: {error}") from error
    content = documents[0] if len(documents) == 1 else None
    if not isinstance(content, dict):
        raise RobotEnvError(f"{path} isn't a YAML file of parameters")
    return content
