"""The world's lock, holds on its time, its pace against the wall clock, and what is sent after a tick."""

import math
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Protocol

from robot_sim.state_dict import Shared

POLL = 0.2  # [s]
MAX_LAG = 0.1  # [s]; a host that falls behind further than this isn't made up for


def _nothing() -> None:
    pass


class FairLock(Shared):
    """A lock that serves its waiters in the order of their arrival.

    The simulation releases and re-acquires its lock in a loop. With threading.Lock that keeps all other
    threads out; here every waiter gets its turn after at most one tick. Raises RuntimeError if the thread
    that holds it acquires it again: it would wait forever.
    """

    def __init__(self) -> None:
        self._guard = threading.Lock()
        self._waiting: deque[tuple[threading.Lock, bool]] = deque()  # and whether they only look
        self._is_lent = False
        self.held = False
        self.holder: int | None = None  # the thread; None also at the moment when it is handed over
        self.turns = 0  # how often it was acquired
        # For the journal. The holder calls the first two, and `between` is called in the middle of long work,
        # while the lock is free.
        self.taken: Callable[[], None] = _nothing
        self.leaving: Callable[[], None] = _nothing
        self.between: Callable[[], None] = _nothing

    def __enter__(self) -> None:
        thread = threading.get_ident()
        if self.holder == thread:
            raise RuntimeError("this thread holds the simulator's lock already")
        self._take()
        self.holder = thread
        self.turns += 1
        self.taken()

    @contextmanager
    def glance(self) -> Iterator[None]:
        """Holds the lock for a look that decides nothing: `taken` and `leaving` aren't called."""
        self._take(looks=True)
        self.holder = threading.get_ident()
        self.turns += 1
        try:
            yield
        finally:
            self._release()

    @contextmanager
    def lent(self) -> Iterator[None]:
        """Lends the lock to `glance` within the block, to one caller after the other.

        The holder calls it while it waits in the middle of a tick. Nobody changes the world meanwhile.
        """
        holder = self.holder
        self._is_lent = True
        self._release()
        try:
            yield
        finally:
            self._take(looks=True)
            self.holder, self._is_lent = holder, False

    def _take(self, looks: bool = False) -> None:
        with self._guard:
            if not self.held and (looks or not self._is_lent):
                self.held = True
                return
            turn = threading.Lock()
            turn.acquire()
            self._waiting.append((turn, looks))
        turn.acquire()

    def wait(self, event: threading.Event, timeout: float) -> None:
        """Releases the lock until `event` is set, or for `timeout` [s]. Only the holder may call it."""
        self.__exit__()
        event.wait(timeout)
        self.__enter__()

    def yield_turn(self) -> None:
        """Lets all waiters go first. The holder calls it in the middle of long work."""
        self.__exit__()
        self.between()
        self.__enter__()

    def __exit__(self, *_: object) -> None:
        try:
            self.leaving()
        finally:
            self._release()

    def _release(self) -> None:
        self.holder = None
        with self._guard:
            for waiter in self._waiting:
                if waiter[1] or not self._is_lent:
                    self._waiting.remove(waiter)
                    waiter[0].release()  # the lock stays held: it is handed over
                    return
            self.held = False


class Holds:
    """Stops time while something that the next step needs is prepared.

    A world that is held isn't paused: only clients pause it.
    """

    def __init__(self, lock: FairLock, changed: Callable[[], None]) -> None:
        """`changed` is called, with the simulator's lock held, when holders come or go."""
        self._lock = lock
        self._changed = changed
        self._holders: set[object] = set()
        self._free = threading.Event()
        self._free.set()

    def __bool__(self) -> bool:
        return bool(self._holders)

    @contextmanager
    def hold(self, patience: float, late: Callable[[], None]) -> Iterator[None]:
        """Stops time within the block. The caller doesn't hold the lock.

        Code in the block that waits for time to pass would wait forever. So time continues after `patience`
        [s of wall time], and `late` is called.
        """
        holder = object()
        with self._lock:
            self._holders.add(holder)
            self._update()
        timer = threading.Timer(patience, self._give_up, (holder, late))
        timer.daemon = True
        try:
            timer.start()  # it may fail, where there is no memory for a thread
            yield
        finally:
            timer.cancel()
            self._release(holder)

    def await_end(self, stopping: threading.Event) -> None:
        """Waits until no one holds time or `stopping` is set, and releases the caller's lock meanwhile."""
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


class Pacer:
    """Waits until the wall clock has caught up with the ticks done so far."""

    def __init__(self) -> None:
        self._due = time.perf_counter()

    def restart(self) -> None:
        """Restarts the count, after a pause."""
        self._due = time.perf_counter()

    def wait(self, period: float, longest: float = math.inf) -> bool:
        """Sleeps until `period` [s of wall time] after the previous due time; 0 never waits.

        Returns False when that takes longer than `longest` [s]: call wait_on() until it is due.
        """
        self._due += period
        if period <= 0.0 or self._due - time.perf_counter() < -MAX_LAG:
            self._due = time.perf_counter()
            return True
        return self.wait_on(longest)

    def wait_on(self, longest: float) -> bool:
        """Sleeps until the due time, but no longer than `longest` [s]; returns whether it is due."""
        delay = self._due - time.perf_counter()
        if delay > 0.0:
            time.sleep(min(delay, longest))
        return delay <= longest


class Outbox(Protocol):
    """Sends clients what a tick has produced, after the tick."""

    def has_messages(self) -> bool:
        """Returns whether there is something to send. The caller holds the lock."""

    def deliver(self) -> None:
        """Sends it. The caller doesn't hold the lock."""
