"""The folder of one run: its name, and its summary as JSON."""

import fcntl
import json
import os
import platform
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from cartpole.errors import CartpoleError
from cartpole.training.checkpoints import write_atomically


def create(run_dir: str | None, env: str, experiment: str, seed: int) -> Path:
    """Makes the run's folder: the one given, or runs/{env}__{experiment}__{seed}__{time}.

    Raises:
        CartpoleError: if the folder holds something already, or can't be made or written to.
    """
    if run_dir:
        folder = Path(run_dir)
    else:
        folder = _fresh_name(Path("runs"), f"{env}__{experiment}__{seed}__{int(time.time())}")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        taken = next(folder.iterdir(), None) is not None
        if not taken:
            write_atomically(folder / ".probe", lambda stream: None)
            (folder / ".probe").unlink()
    except OSError as error:
        raise CartpoleError(f"can't write to the run folder {folder}: {error.strerror}") from error
    if taken:
        raise CartpoleError(
            f"the run folder {folder} isn't empty; name another one or remove its contents"
        )
    return folder.resolve()


@contextmanager
def held(folder: Path) -> Iterator[None]:
    """Keeps a second training out of a run's folder; the lock ends with the process.

    Raises:
        CartpoleError: if another process holds it, or there is no such folder.
    """
    try:
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    except OSError as error:
        raise CartpoleError(f"{folder} is no run folder: {error.strerror}") from error
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        yield
    except BlockingIOError as error:
        raise CartpoleError(f"a training is running in {folder}") from error
    finally:
        os.close(descriptor)


def _fresh_name(parent: Path, name: str) -> Path:
    """Two runs of one second get two folders."""
    folder, number = parent / name, 2
    while folder.exists():
        folder, number = parent / f"{name}_{number}", number + 1
    return folder


def write_summary(path: Path, content: dict[str, Any]) -> None:
    """Writes a JSON file, whole or not at all.

    Raises:
        OSError: if the disk refuses.
    """
    text = json.dumps(content, indent=1, allow_nan=False) + "\n"
    write_atomically(path, lambda stream: stream.write(text.encode()))


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
        "command": " ".join(sys.argv),
    }
