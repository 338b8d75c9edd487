"""Ctrl-C, SIGTERM, a closed terminal and the end of the CPU time that a batch system gives.

At once while things start, at the next step while training.
"""

import contextlib
import signal
from collections.abc import Iterator
from types import FrameType

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGXCPU)


class Interrupt:
    """Takes over these signals from `install()` on, until the process ends.

    Before `defer()` a signal raises KeyboardInterrupt, so any wait ends at once. After it, a
    signal only makes `requested` true: the loop ends at its next step, and saving and
    cleaning up run to their end however often Ctrl-C is pressed.
    """

    def __init__(self) -> None:
        self.signal: int | None = None
        self._deferred = False

    def install(self) -> "Interrupt":
        for number in _SIGNALS:
            # Under nohup a closed terminal is no reason to end.
            if number != signal.SIGHUP or signal.getsignal(number) != signal.SIG_IGN:
                signal.signal(number, self._handle)
        return self

    def defer(self) -> None:
        """From now on signals only set `requested`."""
        self._deferred = True

    def at_once(self) -> None:
        """From now on signals raise KeyboardInterrupt again; one that was deferred does so here."""
        self._deferred = False
        if self.requested():
            raise KeyboardInterrupt

    @contextlib.contextmanager
    def reading(self) -> Iterator[None]:
        """While modules are imported signals wait: what is interrupted there may be left half done."""
        self.defer()
        try:
            yield
        finally:
            self.at_once()

    def requested(self) -> bool:
        return self.signal is not None

    @property
    def exit_code(self) -> int:
        """The shell's convention: 128 + the signal's number, 130 for Ctrl-C; 0 without one."""
        return 0 if self.signal is None else 128 + self.signal

    def _handle(self, number: int, frame: FrameType | None) -> None:
        self.signal = number
        if number == signal.SIGXCPU:  # it comes once a second from now on, also while Python ends
            signal.signal(number, signal.SIG_IGN)
        if not self._deferred:
            raise KeyboardInterrupt
