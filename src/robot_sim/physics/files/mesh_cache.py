"""The mesh cache: results that take long to compute, on disk, by the mesh's content."""

import math
import os
from collections.abc import Callable, Iterable
from contextlib import suppress
from io import BytesIO
from pathlib import Path

import numpy as np
from numpy.lib.format import read_array_header_1_0, read_magic

from file_access.locks import scratch_folder

MOST_BYTES = 4 << 30  # of the folder; beyond them what wasn't used for longest goes


def cache_folder() -> Path:
    """Returns the folder that keeps it."""
    cache = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")
    return Path(cache, "robot_sim", "meshes")


def kept(path: Path, compute: Callable[[], bytes]) -> list[np.ndarray]:
    """Returns the arrays that `compute` writes, or has written into `path` in an earlier call."""
    try:
        mark, content = path.read_bytes().split(b"\n", 1)
        if mark != path.name.encode():  # a file that was cut off
            raise ValueError(mark)
        arrays = read_arrays(content)
    except (OSError, ValueError):
        content = compute()
        arrays = read_arrays(content)
        with suppress(OSError):  # then it is computed anew each time
            keep(path, path.name.encode() + b"\n" + content)
    else:
        with suppress(OSError):
            os.utime(path)
    return arrays


def keep(path: Path, data: bytes) -> None:
    """Writes a file all at once, and makes room for it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with scratch_folder(str(path.parent)) as folder:
        (folder / path.name).write_bytes(data)
        os.replace(folder / path.name, path)
    files = [(each.stat(), each) for each in path.parent.iterdir() if each.is_file()]
    total = sum(stat.st_size for stat, _ in files)
    for stat, each in sorted(files, key=lambda file: file[0].st_mtime):
        if total > MOST_BYTES:
            each.unlink()
            total -= stat.st_size


def written(arrays: Iterable[np.ndarray]) -> bytes:
    """Returns arrays as bytes, one after the other."""
    stream = BytesIO()
    for array in arrays:
        np.save(stream, array, allow_pickle=False)
    return stream.getvalue()


def read_arrays(data: bytes) -> list[np.ndarray]:
    """Returns the arrays that `written` has written, without a copy of those that are aligned."""
    stream, arrays = BytesIO(data), []
    while stream.tell() < len(data):
        read_magic(stream)
        shape, by_columns, dtype = read_array_header_1_0(stream)
        flat = np.frombuffer(data, dtype, math.prod(shape), stream.tell())
        stream.seek(flat.nbytes, os.SEEK_CUR)
        array = flat.reshape(shape, order="F" if by_columns else "C")
        arrays.append(np.require(array, requirements="A"))
        arrays[-1].setflags(write=False)
    return arrays
