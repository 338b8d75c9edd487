"""Reads a robot's files: its URDF, through xacro if it is one, and its controllers' parameters."""

from functools import lru_cache
from pathlib import Path
from typing import Any

import yaml

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
        content = yaml.safe_load(path.read_bytes())  # it finds out about UTF-16 by itself
    except OSError as error:
        raise RobotEnvError(f"can't read {path}: {error.strerror}") from error
    except yaml.YAMLError as error:
        raise RobotEnvError(f"{path} isn't YAML: {' '.join(str(error).split())}") from error
    if not isinstance(content, dict):
        raise RobotEnvError(f"{path} isn't a YAML file of parameters")
    return content
