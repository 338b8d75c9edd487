"""Errors of the control room, and what a user's code is caught at."""

import threading

from files.content import one_line


class ControlError(ValueError):
    """A controller or a robot description that can't work: the text says what to mend."""

    def __init__(self, text: str) -> None:
        """Names in a file may hold anything: `text` is made one line, of a length for a log."""
        super().__init__(one_line(text))


def faults() -> tuple[type[BaseException], ...]:
    """What a user's code is caught at, as in ``except faults()``: whatever it may raise.

    A script's sys.exit() must not end the simulator, nor stop its time. Only an interrupt in the main
    thread is not the code's own: it is somebody's Ctrl-C, wherever it comes up.
    """
    if threading.current_thread() is threading.main_thread():
        return (Exception, SystemExit, GeneratorExit)
    return (BaseException,)
