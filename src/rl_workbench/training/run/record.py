"""config.json in a run folder: what was trained, by which command, with which versions."""

import json
import math
import time
from pathlib import Path
from typing import Any

from rl_workbench.errors import WorkbenchError
from rl_workbench.training.run import folder as run_folder
from rl_workbench.training.run.files import as_json, write_atomically

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
        return json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise WorkbenchError(f"{folder} is no run folder: {path}: {error.strerror}") from error
    except ValueError as error:
        raise WorkbenchError(f"{path} isn't JSON: {error}") from error


def write_record(folder: Path, config: dict[str, Any], resumed: bool) -> None:
    """Writes it; of a resumed training, whose length may be new, versions and begin stay.

    Raises:
        OSError: if the disk refuses.
        WorkbenchError: if the record of a resumed training is damaged.
    """
    record: dict[str, Any] = {"versions": run_folder.versions(), "began": time.time()}
    if resumed:
        record = read_record(folder)
    write_atomically(folder / CONFIG_RECORD, as_json({**record, **config}))
