"""Ctrl-C while a command is still reading its modules."""

import contextlib
import signal
from collections.abc import Iterator


@contextlib.contextmanager
def ended_by_ctrl_c() -> Iterator[None]:
    """Ctrl-C ends the process inside, as it ends one that has no handler.

    A KeyboardInterrupt could be swallowed by a module that is being imported, which would be left
    half there: torch does so. A process that ignores Ctrl-C goes on ignoring it.
    """
    before = signal.getsignal(signal.SIGINT)
    if before is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    yield
    if before is signal.default_int_handler:
        signal.signal(signal.SIGINT, before)
