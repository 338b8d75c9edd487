"""PyBullet's module, which is imported here and nowhere else.

It greets every process with a line about when it was built, written from C to the standard error's file
descriptor, where Python can't filter it.
"""

import contextlib
import os
import tempfile
from collections.abc import Iterator

import numpy  # noqa: F401 - PyBullet imports it; so nothing but PyBullet is imported below

__all__ = ["pybullet"]

STDERR = 2  # its file descriptor, whatever sys.stderr is
GREETING = b"pybullet build time:"


@contextlib.contextmanager
def _without_greeting() -> Iterator[None]:
    """Leaves out the line; all else that this process writes meanwhile comes afterwards."""
    try:
        stderr = os.dup(STDERR)
    except OSError:  # it is closed, so there is nobody to greet
        yield
        return
    with tempfile.TemporaryFile() as held:
        os.dup2(held.fileno(), STDERR)
        try:
            yield
        finally:
            os.dup2(stderr, STDERR)
            os.close(stderr)
            held.seek(0)
            kept = [line for line in held if not line.startswith(GREETING)]
            if kept:
                os.write(STDERR, b"".join(kept))


with _without_greeting():
    import pybullet
