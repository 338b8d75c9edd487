"""Run folders of trainings: name, lock, and config.json with the versions that wrote it."""

import contextlib
import platform
import shlex
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from file_access.locks import is_locked, locked_folder
from rl_workbench.env_ids import as_file_name
from rl_workbench.errors import WorkbenchError
from rl_workbench.storage import CONFIG_RECORD, as_json, check_writable, read_record, write_atomically

EXTRA = "stable_baselines3"
LIBRARIES = ("python", "numpy", "torch", "gymnasium", EXTRA)  # a training's bits depend on them


@contextlib.contextmanager
def opened(run_dir: str, env: str, experiment: str, seed: int) -> Iterator[Path]:
    """Makes and locks a new run's folder: the one given, or runs/{env}__{experiment}__{seed}__{time}.

    A training that makes a folder and can't begin removes it again. Raises WorkbenchError if it isn't empty,
    another training runs in it, or it can't be made or written to.
    """
    name = as_file_name(f"{env}__{experiment}__{seed}__{int(time.time())}")
    folder = Path(run_dir or Path("runs") / name)
    try:
        if run_dir:
            folder.mkdir(parents=True, exist_ok=True)
        else:
            folder = _make_new(folder)
    except OSError as error:
        raise WorkbenchError(f"can't write to the run folder {folder}: {error.strerror}") from error
    with held(folder):
        try:
            if any(folder.iterdir()):
                raise WorkbenchError(
                    f"the run folder {folder} isn't empty; name another one or remove its contents"
                )
            check_writable(folder / CONFIG_RECORD)
            yield folder.resolve()
        finally:
            with contextlib.suppress(OSError):  # it isn't empty: all is well
                folder.rmdir()


def _make_new(wanted: Path) -> Path:
    """Makes a folder; two runs of one second get two."""
    wanted.parent.mkdir(parents=True, exist_ok=True)
    folder, number = wanted, 2
    while True:
        try:
            folder.mkdir()
            return folder
        except FileExistsError:
            folder, number = wanted.with_name(f"{wanted.name}_{number}"), number + 1


@contextlib.contextmanager
def held(folder: Path, holder: str = "a training") -> Iterator[None]:
    """Keeps a second training out of a run's folder. The lock ends with the process."""
    with contextlib.ExitStack() as holding:
        try:
            holding.enter_context(locked_folder(folder))
        except BlockingIOError as error:
            raise WorkbenchError(f"{holder} is running in {folder}") from error
        except OSError as error:
            reason = error.strerror or "it was removed just now"
            raise WorkbenchError(f"{folder} is not a run folder: {reason}") from error
        yield


def is_held(folder: Path) -> bool:
    """Returns whether a training runs in a folder."""
    return folder.is_dir() and is_locked(folder)


def versions() -> dict[str, str]:
    """Returns the versions of interpreter and libraries, the machine, and the command."""
    import gymnasium
    import numpy
    import torch

    return {
        "python": platform.python_version(),
        "numpy": numpy.__version__,
        "torch": torch.__version__,
        "gymnasium": gymnasium.__version__,
        **({EXTRA: sys.modules[EXTRA].__version__} if EXTRA in sys.modules else {}),  # if it trains
        "machine": platform.platform(),
        "command": shlex.join(sys.argv),
    }


def library_versions() -> dict[str, str]:
    """Returns the versions on which a training's bits depend."""
    return {name: each for name, each in versions().items() if name in LIBRARIES}


def other_versions(before: Any) -> str:
    """Returns how versions differ from those `before`, which may be damaged; empty if they don't."""
    if not isinstance(before, dict):
        return ""
    now = versions()
    names = [name for name in LIBRARIES if name in before and before[name] != now.get(name)]
    return ", ".join(f"{name} {before[name]} is now {now.get(name)}" for name in names)


def write_record(folder: Path, config: dict[str, Any], resumed: bool) -> None:
    """Writes config.json; a resumed training keeps its versions and its start. Raises OSError if it can't."""
    record: dict[str, Any] = {"versions": versions(), "began": time.time()}
    if resumed:
        record = read_record(folder)
    write_atomically(folder / CONFIG_RECORD, as_json({**record, **config}))
