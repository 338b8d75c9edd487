"""Time held while something is made ready that has to be there before the next step."""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from bullet_gazebo.timing.fair_lock import FairLock

POLL = 0.2  # [s]


class Holds:
    """Who holds time at the moment. A world that is held is not paused: pausing is the clients' affair."""

    def __init__(self, lock: FairLock, changed: Callable[[], None]) -> None:
        """`lock` is the simulator's; `changed` is called under it."""
        self._lock = lock
        self._changed = changed
        self._holders: set[object] = set()
        self._free = threading.Event()
        self._free.set()

    def __bool__(self) -> bool:
        return bool(self._holders)

    @contextmanager
    def hold(self, patience: float, late: Callable[[], None]) -> Iterator[None]:
        """Lets no time pass within the block; not called under the lock.

        What waits for time to pass in there would wait for ever: after `patience` [s of wall time] time goes
        on, and `late` is called.
        """
        holder = object()
        with self._lock:
            self._holders.add(holder)
            self._update()
        timer = threading.Timer(patience, self._give_up, (holder, late))
        timer.daemon = True
        try:
            timer.start()  # may fail: where memory is short there is no thread to be had
            yield
        finally:
            timer.cancel()
            self._release(holder)

    def await_end(self, stopping: threading.Event) -> None:
        """Returns when nobody holds time, or `stopping` is set; the caller's lock is let go of meanwhile."""
        while self._holders and not stopping.is_set():
            self._lock.wait(self._free, POLL)

    def _give_up(self, holder: object, late: Callable[[], None]) -> None:
        if self._release(holder):
            late()

    def _release(self, holder: object) -> bool:
        with self._lock:
            if holder not in self._holders:
                return False
            self._holders.remove(holder)
            self._update()
            return True

    def _update(self) -> None:
        if self._holders:
            self._free.clear()
        else:
            self._free.set()
        self._changed()
