"""How commands start: Ctrl-C while they still read their modules, and how one starts another."""

import contextlib
import os
import signal
import sys
from collections.abc import Iterator
from types import FrameType
from typing import NoReturn


@contextlib.contextmanager
def ended_by_ctrl_c() -> Iterator[None]:
    """Ctrl-C ends the process inside with a line, and 130.

    A KeyboardInterrupt could be swallowed by a module that is being imported, which would be left
    half there: torch does so. A process that ignores Ctrl-C goes on ignoring it.
    """
    before = signal.getsignal(signal.SIGINT)
    if before is signal.default_int_handler:
        signal.signal(signal.SIGINT, _end)
    yield
    if before is signal.default_int_handler:
        signal.signal(signal.SIGINT, before)


def _end(number: int, frame: FrameType | None) -> NoReturn:
    folder, name = os.path.split(sys.argv[0])
    if name == "__main__.py":  # `python3 -m rl_workbench`
        name = os.path.basename(folder)
    with contextlib.suppress(OSError):
        os.write(2, f"{name}: interrupted\n".encode())
    os._exit(128 + number)


def program(module: str) -> tuple[str, ...]:
    """What starts a module as a process of its own, which doesn't search the current folder for modules.

    A user's `token.py` there would stand in for the standard library's. See `search_path`.
    """
    return (sys.executable, "-P", "-m", module)


def search_path() -> str:
    """PYTHONPATH of a process that is to find the modules that this one finds."""
    import sysconfig  # not before Ctrl-C is seen to

    standard = sysconfig.get_path("stdlib")
    found = sys.path.index(standard) if standard in sys.path else len(sys.path)
    return os.pathsep.join(dict.fromkeys(map(os.path.abspath, sys.path[:found])))
