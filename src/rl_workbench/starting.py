"""How commands start: Ctrl-C while they still read their modules, and how one starts another."""

import contextlib
import os
import signal
import sys
import sysconfig
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


def program(module: str) -> tuple[str, ...]:
    """What starts a module as a process of its own, which doesn't search the current folder for modules.

    A user's `token.py` there would stand in for the standard library's. See `search_path`.
    """
    return (sys.executable, "-P", "-m", module)


def search_path() -> str:
    """PYTHONPATH of a process that is to find the modules that this one finds."""
    standard = sysconfig.get_path("stdlib")
    found = sys.path.index(standard) if standard in sys.path else len(sys.path)
    return os.pathsep.join(dict.fromkeys(map(os.path.abspath, sys.path[:found])))
