"""Errors of controllers, and which exceptions of users' code are caught."""

import threading

from file_access.text import one_line


class ControlError(ValueError):
    """A controller or robot description can't work: one line that says what to change."""

    def __init__(self, text: str) -> None:
        super().__init__(one_line(text))


def faults() -> tuple[type[BaseException], ...]:
    """Returns the exceptions to catch from a user's code, as in ``except faults()``: all of them.

    A script's sys.exit() must not end the simulator. Only a KeyboardInterrupt in the main thread isn't the
    code's own: it is a Ctrl-C.
    """
    if threading.current_thread() is threading.main_thread():
        return (Exception, SystemExit, GeneratorExit)
    return (BaseException,)
