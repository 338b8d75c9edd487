"""Standard output whose reader goes away, as in ``train --help | head``."""

import contextlib
import os
import select
import sys
from collections.abc import Iterator


@contextlib.contextmanager
def reader_may_go() -> Iterator[None]:
    """Ends what runs inside without a word once nobody reads, also what is left to write at the end."""
    try:
        yield
        if sys.stdout is not None:  # it may have been closed by >&-
            sys.stdout.flush()
    except BrokenPipeError:
        if not _nobody_reads():  # it was another pipe
            raise
    finally:
        if _nobody_reads():
            with open(os.devnull, "wb") as nowhere:  # Python flushes it once more
                os.dup2(nowhere.fileno(), sys.stdout.fileno())


def _nobody_reads() -> bool:
    """Whether standard output is a pipe without a reader."""
    try:
        descriptor = sys.stdout.fileno()
    except (AttributeError, OSError, ValueError):  # closed, or a test's
        return False
    looking = select.poll()
    looking.register(descriptor, 0)
    return any(events & select.POLLERR for _, events in looking.poll(0))
