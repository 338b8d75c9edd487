"""Files of trainings: atomic writing, and reading with errors of one line."""

import contextlib
import io
import json
import os
import pickle
import secrets
import zipfile
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, BinaryIO

from file_access.content import open_text
from rl_workbench.errors import WorkbenchError

# What reading a damaged file of torch's may raise.
DAMAGED = (RuntimeError, pickle.UnpicklingError, EOFError, ValueError, KeyError, TypeError,
           AttributeError, IndexError, zipfile.BadZipFile, zlib.error)  # fmt: skip
Writer = Callable[[BinaryIO], object]  # fills a file


def write_atomically(path: Path, write: Writer) -> None:
    """Lets `write` fill a file that replaces `path` once it is complete and on disk; or raises OSError."""
    temporary = path.with_name(f".{path.name}.{secrets.token_hex(4)}")
    try:
        with temporary.open("xb") as stream:
            write(stream)
            stream.flush()
            os.fsync(stream.fileno())
        os.replace(temporary, path)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise
    folder = os.open(path.parent, os.O_RDONLY)
    try:
        os.fsync(folder)  # so that the new name survives a power cut
    finally:
        os.close(folder)


def write_file(path: Path, write: Writer, shown: Path | None = None) -> None:
    """Writes a file that the user asked for, as `shown`, atomically; else raises WorkbenchError."""
    shown = shown or path
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(path, write)
    except FileExistsError as error:
        raise WorkbenchError(f"can't write {shown}: {shown.parent} is not a folder") from error
    except OSError as error:
        raise WorkbenchError(f"can't write {shown}: {error.strerror or error}") from error


@contextlib.contextmanager
def reading(path: Path, fault: str, wrong: tuple[type[Exception], ...] = DAMAGED) -> Iterator[None]:
    """Turns errors while a file is read into one line; `fault` is what `wrong` ones mean, with {} for why."""
    try:
        yield
    except OSError as error:
        raise WorkbenchError(f"can't read {path}: {error.strerror or error}") from error
    except wrong as error:
        why = " ".join(str(error).split())
        raise WorkbenchError(f"{path} {fault.format(why)}") from error


def check_archive(file: BinaryIO) -> None:
    """Raises BadZipFile if a file of torch's is damaged: torch doesn't verify checksums."""
    with zipfile.ZipFile(file) as archive:
        if archive.testzip():
            raise zipfile.BadZipFile
    file.seek(0)


def check_writable(path: Path) -> None:
    """Checks that a file can be written, before hours are spent on its content."""
    if path.is_dir():
        raise WorkbenchError(f"can't write {path}: it is a folder")
    probe = path.with_name(f".{path.name}.probe")
    write_file(probe, as_text(""), path)
    probe.unlink()


def as_text(text: str) -> Writer:
    """Returns a writer of a text."""
    return lambda stream: stream.write(text.encode())


def as_json(content: Any) -> Writer:
    """Returns a writer of JSON; raises ValueError if a number is NaN or infinite."""
    return as_text(json.dumps(content, indent=1, allow_nan=False) + "\n")


def save_tensors(path: Path, content: dict[str, Any]) -> None:
    """Writes a file for `torch.load`; raises OSError if it can't, and an older file is untouched.

    The content is serialised in memory first, since torch hides a full disk behind an error of its own.
    """
    import torch  # takes seconds to import, and most files don't need it

    memory = io.BytesIO()
    torch.save(content, memory)
    write_atomically(path, lambda stream: stream.write(memory.getbuffer()))


CONFIG_RECORD = "config.json"


def read_json(path: Path) -> Any:
    """Returns the content of a JSON file; None if there is no such file."""
    try:
        with open_text(path) as file:
            return json.load(file)
    except (FileNotFoundError, NotADirectoryError):
        return None
    except OSError as error:
        raise WorkbenchError(f"can't read {path}: {error.strerror}") from error
    except (ValueError, RecursionError) as error:  # the latter for deeply nested brackets
        raise WorkbenchError(f"{path} isn't JSON: {error}") from error


def read_record(folder: Path) -> Any:
    """Reads a run folder's config.json."""
    record = read_json(folder / CONFIG_RECORD)
    if record is None:
        why = f"it has no {CONFIG_RECORD}" if folder.is_dir() else "there is no such folder"
        why = "it is a file; RUN is a folder, as runs/NAME" if folder.is_file() else why
        raise WorkbenchError(f"{folder} is not a run folder: {why}")
    return record
