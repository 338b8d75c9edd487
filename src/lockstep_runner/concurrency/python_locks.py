"""The script's own threading.Lock and RLock: a thread that waits for one rests.

Otherwise a callback blocked on a lock would seem to compute, and the lock's holder would wait for it.
"""

import math
import sys
import threading
from typing import Any

from lockstep_runner.runner import ScriptRunner
from lockstep_runner.script import GO_BETWEENS, is_the_script
from lockstep_runner.world import NANOSECONDS


def install(runner: ScriptRunner) -> None:
    """Replaces threading.Lock and threading.RLock."""
    make_lock, make_rlock = threading.Lock, threading.RLock

    def lock() -> Any:
        return _Lock(runner, make_lock()) if _is_asked_for_by_the_script() else make_lock()

    def rlock() -> Any:
        ours = _is_asked_for_by_the_script()
        return _RLock(_Lock(runner, make_lock())) if ours else make_rlock()

    threading.Lock = lock  # type: ignore[assignment]
    threading.RLock = rlock  # type: ignore[assignment]


def _is_asked_for_by_the_script() -> bool:
    """Returns False for locks inside Event and the like, held briefly; a Condition's may be held long."""
    return is_the_script(2) and (
        sys._getframe(2).f_globals.get("__name__") not in GO_BETWEENS
        or sys._getframe(2).f_code is threading.Condition.__init__.__code__
    )


class _Lock:
    """A lock whose waits take simulated time if the clock controls waiter and holder."""

    def __init__(self, runner: ScriptRunner, real: Any) -> None:
        self._runner = runner
        self._real = real
        self._holder = 0  # id of the thread that holds it; 0 if free
        self._at_fork_reinit = real._at_fork_reinit

    def acquire(self, blocking: bool = True, timeout: float = -1) -> bool:
        """As Python's own."""
        if timeout == -1 or not blocking:  # Python's own lock rejects a time limit without blocking
            came = self._real.acquire(False) if blocking else self._real.acquire(False, timeout)
        else:
            came = self._real.acquire(True, 0 if timeout > 0 else timeout)
        if not came and blocking and timeout != 0:
            came = self._wait(math.inf if timeout == -1 else timeout)
        if came:
            self._holder = threading.get_ident()
        return bool(came)

    __enter__ = acquire

    def __exit__(self, *_: object) -> None:
        self.release()

    def release(self) -> None:
        """As Python's own."""
        holder, self._holder = self._holder, 0
        try:
            self._real.release()
        except RuntimeError:
            self._holder = holder
            raise

    def locked(self) -> bool:
        """As Python's own."""
        return bool(self._real.locked())

    def _wait(self, seconds: float) -> bool:
        """Waits for the lock and takes it; in wall time if the clock doesn't control its holder."""
        runner, clock = self._runner, self._runner.clock
        end = clock.passed + seconds * NANOSECONDS
        while (
            clock.covers_this_thread()
            and clock.covers(self._holder)
            and not runner.is_over
            and runner.is_connected()
        ):
            left = (end - clock.passed) / NANOSECONDS
            came = runner.wait_for_event(left, lambda: not self._holder)
            if came and self._real.acquire(False):
                return True
            if not came and not runner.is_over and clock.passed >= end:
                return False
        return bool(self._real.acquire(True, -1 if seconds == math.inf else seconds))


class _RLock(threading._RLock):  # type: ignore[misc]
    """A lock that its holder may take again: Python's own one in Python, whose lock is replaced."""

    def __init__(self, lock: _Lock) -> None:
        super().__init__()
        self._block = lock
