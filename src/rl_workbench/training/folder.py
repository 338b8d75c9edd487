"""The folder of one run: its name, who holds it, and the versions that write in it."""

import contextlib
import fcntl
import os
import platform
import shlex
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from rl_workbench.env_ids import as_file_name
from rl_workbench.errors import WorkbenchError
from rl_workbench.storage import CONFIG_RECORD, as_json, read_record, write_atomically

EXTRA = "stable_baselines3"
LIBRARIES = ("python", "numpy", "torch", "gymnasium", EXTRA)  # a training's bits depend on them


@contextlib.contextmanager
def opened(run_dir: str, env: str, experiment: str, seed: int) -> Iterator[Path]:
    """A new run's folder, held: the one given, or runs/{env}__{experiment}__{seed}__{time}.

    Slashes and colons of the names become hyphens there. Whoever makes a folder and can't begin
    leaves none behind; who comes second leaves the first one's alone.

    Raises:
        WorkbenchError: if the folder holds something already, another training runs in it, or it
            can't be made or written to.
    """
    name = as_file_name(f"{env}__{experiment}__{seed}__{int(time.time())}")
    folder = Path(run_dir or Path("runs") / name)
    try:
        if run_dir:
            _make(folder)
        else:
            folder = _fresh(folder)
    except OSError as error:
        raise _no_place(folder, error) from error
    with held(folder):
        try:
            _check_empty(folder)
            yield folder.resolve()
        finally:
            with contextlib.suppress(OSError):  # it isn't empty: all is well
                folder.rmdir()


def _make(folder: Path) -> None:
    """Makes it, if it isn't there; also where somebody who can't begin removes it in the same moment."""
    while True:
        try:
            folder.mkdir(parents=True, exist_ok=True)
            return
        except FileExistsError:  # it was there, and then it was no folder
            if folder.exists():
                raise


def _check_empty(folder: Path) -> None:
    try:
        taken = next(folder.iterdir(), None) is not None
        if not taken:
            write_atomically(folder / ".probe", lambda stream: None)
            (folder / ".probe").unlink()
    except OSError as error:
        raise _no_place(folder, error) from error
    if taken:
        raise WorkbenchError(
            f"the run folder {folder} isn't empty; name another one or remove its contents"
        )


def _no_place(folder: Path, error: OSError) -> WorkbenchError:
    return WorkbenchError(f"can't write to the run folder {folder}: {error.strerror}")


@contextlib.contextmanager
def held(folder: Path, holder: str = "a training") -> Iterator[None]:
    """Keeps a second training out of a run's folder; the lock ends with the process.

    Args:
        holder: what may hold it, for the error.

    Raises:
        WorkbenchError: if another process holds it, or there is no such folder.
    """
    try:
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    except OSError as error:
        raise WorkbenchError(f"{folder} is no run folder: {error.strerror}") from error
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise WorkbenchError(f"{holder} is running in {folder}") from error
        if not _is_at(descriptor, folder):  # its last holder has removed it meanwhile
            raise WorkbenchError(f"{folder} is no run folder: it was removed just now")
        yield
    finally:
        os.close(descriptor)


def is_held(folder: Path) -> bool:
    """Whether a training runs in a folder. One that begins in this very moment may be refused: ask seldom."""
    try:
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    except OSError:
        return False
    try:
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    finally:
        os.close(descriptor)
    return False


def _is_at(descriptor: int, folder: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(descriptor), folder.stat())
    except FileNotFoundError:
        return False


def _fresh(wanted: Path) -> Path:
    """Makes a folder; two runs of one second get two."""
    wanted.parent.mkdir(parents=True, exist_ok=True)
    folder, number = wanted, 2
    while True:
        try:
            folder.mkdir()
            return folder
        except FileExistsError:
            folder, number = wanted.with_name(f"{wanted.name}_{number}"), number + 1


def other_versions(before: Any) -> str:
    """Where those that a training began with aren't those of now; empty if they are the same.

    Args:
        before: what `versions` gave then; no training depends on it, so it may be damaged.
    """
    if not isinstance(before, dict):
        return ""
    now = versions()
    names = [name for name in LIBRARIES if name in before and before[name] != now.get(name)]
    return ", ".join(f"{name} {before[name]} is now {now.get(name)}" for name in names)


def versions() -> dict[str, str]:
    """What the figures depend on: interpreter, libraries, machine, the command."""
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


def write_record(folder: Path, config: dict[str, Any], resumed: bool) -> None:
    """Writes it; of a resumed training, whose length may be new, versions and begin stay.

    Raises:
        OSError: if the disk refuses.
        WorkbenchError: if the record of a resumed training is damaged.
    """
    record: dict[str, Any] = {"versions": versions(), "began": time.time()}
    if resumed:
        record = read_record(folder)
    write_atomically(folder / CONFIG_RECORD, as_json({**record, **config}))
