"""The folder of one run: its name, who holds it, and the versions that write in it."""

import contextlib
import fcntl
import os
import platform
import re
import shlex
import sys
import time
from collections.abc import Iterator, Mapping
from pathlib import Path

from rl_workbench.errors import WorkbenchError
from rl_workbench.training.run.files import write_atomically

LIBRARIES = ("python", "numpy", "torch", "gymnasium")  # a training's bits depend on them


def create(run_dir: str | None, env: str, experiment: str, seed: int) -> Path:
    """Makes the run's folder: the one given, or runs/{env}__{experiment}__{seed}__{time}.

    Slashes and colons of the names become hyphens there.

    Raises:
        WorkbenchError: if the folder holds something already, or can't be made or written to.
    """
    name = re.sub("[/:]", "-", f"{env}__{experiment}__{seed}__{int(time.time())}")
    folder = Path(run_dir or Path("runs") / name)
    try:
        if run_dir:
            folder.mkdir(parents=True, exist_ok=True)
        else:
            folder = _fresh(folder)
        taken = next(folder.iterdir(), None) is not None
        if not taken:
            write_atomically(folder / ".probe", lambda stream: None)
            (folder / ".probe").unlink()
    except OSError as error:
        raise WorkbenchError(f"can't write to the run folder {folder}: {error.strerror}") from error
    if taken:
        raise WorkbenchError(
            f"the run folder {folder} isn't empty; name another one or remove its contents"
        )
    return folder.resolve()


def remove_if_empty(folder: Path) -> None:
    """Leaves no folder behind of a training that couldn't begin."""
    with contextlib.suppress(OSError):
        folder.rmdir()


@contextlib.contextmanager
def held(folder: Path) -> Iterator[None]:
    """Keeps a second training out of a run's folder; the lock ends with the process.

    Raises:
        WorkbenchError: if another process holds it, or there is no such folder.
    """
    try:
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    except OSError as error:
        raise WorkbenchError(f"{folder} is no run folder: {error.strerror}") from error
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        yield
    except BlockingIOError as error:
        raise WorkbenchError(f"a training is running in {folder}") from error
    finally:
        os.close(descriptor)


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


def other_versions(before: Mapping[str, str]) -> str:
    """Where those that a training began with aren't those of now; empty if they are the same.

    Args:
        before: what `versions` gave then.
    """
    now = versions()
    names = [name for name in LIBRARIES if name in before and before[name] != now[name]]
    return ", ".join(f"{name} {before[name]} is now {now[name]}" for name in names)


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
        "machine": platform.platform(),
        "command": shlex.join(sys.argv),
    }
