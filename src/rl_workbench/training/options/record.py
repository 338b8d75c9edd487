"""config.json in a run folder: what was trained, by which command, with which versions."""

import json
import math
from pathlib import Path
from typing import Any

from files.content import open_text
from rl_workbench.errors import WorkbenchError

CONFIG_RECORD = "config.json"


def is_plain(value: Any) -> bool:
    """Whether JSON keeps it as it is."""
    if isinstance(value, dict):
        return all(isinstance(key, str) and is_plain(each) for key, each in value.items())
    if isinstance(value, list):
        return all(is_plain(each) for each in value)
    if isinstance(value, float):
        return math.isfinite(value)
    return value is None or isinstance(value, bool | int | str)


def read_record(folder: Path) -> Any:
    """What config.json holds.

    Raises:
        WorkbenchError: if there is none, or it isn't JSON.
    """
    path = folder / CONFIG_RECORD
    try:
        with open_text(path) as file:
            return json.load(file)
    except OSError as error:
        raise WorkbenchError(f"{folder} is no run folder: {path}: {error.strerror}") from error
    except (ValueError, RecursionError) as error:  # the latter of brackets within brackets
        raise WorkbenchError(f"{path} isn't JSON: {error}") from error
