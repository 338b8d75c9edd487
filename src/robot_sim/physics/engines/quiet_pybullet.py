"""pybullet without its greeting; the only place that imports it.

pybullet greets every process with its build time, written in C to the C library's `stderr`, where Python
can't filter it.
"""

import contextlib
import ctypes
import os
from collections.abc import Iterator

__all__ = ["pybullet"]

STDERR = 2  # its file descriptor, whatever sys.stderr is
GREETING = b"pybullet build time:"


@contextlib.contextmanager
def _without_greeting() -> Iterator[None]:
    """Drops the line.

    Only C's stream `stderr` is redirected, into memory. The file descriptor stays, so that other threads,
    which may be writing at any moment, aren't affected.

    The stream is never closed, and the place that it keeps its text's address and size in never freed:
    another thread may have begun to use it, and C++ flushes it when the process ends if its own streams
    began here.
    """
    library = ctypes.CDLL(None)
    try:
        stream = ctypes.c_void_p.in_dll(library, "stderr")
    except ValueError:  # a C library of another kind: the line is harmless
        yield
        return
    library.open_memstream.restype = library.calloc.restype = ctypes.c_void_p
    place = library.calloc(ctypes.c_size_t(2), ctypes.c_size_t(ctypes.sizeof(ctypes.c_void_p)))
    text = ctypes.c_void_p.from_address(place)
    size = ctypes.c_size_t.from_address(place + ctypes.sizeof(text))
    held = library.open_memstream(ctypes.byref(text), ctypes.byref(size))
    before, stream.value = stream.value, held
    try:
        yield
    finally:
        stream.value = before
        library.fflush(ctypes.c_void_p(held))
        lines = ctypes.string_at(text, size.value).splitlines(keepends=True)
        kept = b"".join(line for line in lines if not line.startswith(GREETING))
        if kept:
            with contextlib.suppress(OSError):  # it is closed
                os.write(STDERR, kept)


with _without_greeting():
    import pybullet
