"""Checkpoints of a training. A file is either complete or absent, and is checked when it is read.

    RUN_DIR/checkpoints/step_000005000.pt   the newest few
    RUN_DIR/last.pt, RUN_DIR/best.pt        the newest, and that of the best evaluation

Each holds everything. last.pt and best.pt are further names of numbered files.
"""

import contextlib
import errno
import os
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import torch

from file_access.content import open_file
from rl_workbench.errors import WorkbenchError
from rl_workbench.storage import check_archive, reading, save_tensors

LAST, BEST = "last.pt", "best.pt"
FOLDER = "checkpoints"
LEFTOVERS = (".*.pt.*", ".*.pt.new", ".*.pth.*", ".*.json.*", ".*.png.*")  # of a killed write
FORMAT = "rl_workbench 2"  # changes when older files can't be read any more
_MISFITS = (LookupError, TypeError, ValueError, RuntimeError, AttributeError, ArithmeticError)


class Checkpoints:
    """Writes the checkpoints of one run."""

    def __init__(self, run: Path, keep: int) -> None:
        self._run, self._keep = run, keep
        self._place = run.stat()

    def are_in_place(self) -> bool:
        """Returns whether the run folder is still where it was."""
        try:
            return os.path.samestat(self._run.stat(), self._place)
        except FileNotFoundError:
            return False

    def check_place(self) -> None:
        """Raises OSError if the run folder was moved or removed: another may be in its place."""
        if not self.are_in_place():
            moved = "the folder was moved or removed"
            raise FileNotFoundError(errno.ENOENT, moved, str(self._run))

    def save(self, step: int, content: dict[str, Any], best: bool = False) -> Path:
        """Writes a checkpoint as the last one, also as the best one if `best`; raises OSError if it can't."""
        self.check_place()
        path = self._run / FOLDER / f"step_{step:09d}.pt"
        path.parent.mkdir(exist_ok=True)
        save_tensors(path, {"format": FORMAT, **content})
        # LAST comes last: if killed in between, a training resumes from before its best step.
        for name in (BEST, LAST) if best else (LAST,):
            give_name(path, self._run / name)
        if self._keep:
            for old in _numbered(self._run)[self._keep :]:
                if old != path:
                    old.unlink()
        return path

    def remove_leftovers(self) -> None:
        """Removes the partial files of a killed training. The caller holds the folder's lock."""
        for folder in (self._run, self._run / FOLDER):
            for pattern in LEFTOVERS:
                for path in folder.glob(pattern):
                    path.unlink()


def give_name(path: Path, name: Path) -> None:
    """Gives a file a second name in one step; a copy where the file system has no hard links."""
    temporary = name.with_name(f".{name.name}.new")
    temporary.unlink(missing_ok=True)
    try:
        os.link(path, temporary)
    except OSError:
        shutil.copyfile(path, temporary)
    os.replace(temporary, name)


def _numbered(run: Path) -> list[Path]:
    """Returns the numbered checkpoints of a run, the newest first."""
    paths = (run / FOLDER).glob("step_*.pt")
    return sorted(paths, key=lambda path: (len(path.name), path.name), reverse=True)


def read(path: Path) -> dict[str, Any]:
    """Reads a checkpoint into main memory. A foreign file can't run code."""
    with reading(path, "is damaged, or no checkpoint"), open_file(path) as file:
        check_archive(file)
        content = torch.load(file, map_location="cpu", weights_only=True)
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        raise WorkbenchError(f"{path} is not a checkpoint of a training")
    return content


@contextlib.contextmanager
def fitting(what: str) -> Iterator[None]:
    """Turns errors into one line while something is loaded from a checkpoint."""
    try:
        yield
    except _MISFITS as error:
        text = str(error).split("\n")[0] or type(error).__name__
        raise WorkbenchError(f"the checkpoint holds another {what}: {text}") from error


def read_newest(run: Path, say: Callable[[str], None]) -> dict[str, Any]:
    """Reads the last checkpoint, or the newest before it that is readable; reports what it skips."""
    for path in candidates(run):
        try:
            return read(path)
        except WorkbenchError as error:
            say(f"{error}; looking for an earlier one")
    raise WorkbenchError(f"{run} holds no checkpoint to continue from")


def candidates(run: Path, best_first: bool = False) -> list[Path]:
    """Returns checkpoints in the order in which to try them, each file once.

    That is last.pt, the numbered ones from the newest on, and best.pt at the end or, with `best_first`, at
    the start.
    """
    best, others = [run / BEST], [run / LAST, *_numbered(run)]
    paths: dict[object, Path] = {}
    for path in best + others if best_first else others + best:
        try:
            status = path.stat()
        except OSError:
            continue
        paths.setdefault((status.st_dev, status.st_ino), path)
    return list(paths.values())
