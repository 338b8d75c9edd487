"""A lock that serves its waiters in the order in which they came."""

import threading
from collections import deque
from types import TracebackType


class FairLock:
    """First come, first served.

    threading.Lock lets a thread that releases and re-acquires it in a loop, as the simulation does, keep
    all others out. Here every waiter gets its turn after at most one tick.

    Raises:
        RuntimeError: if the thread that holds it takes it once more, for which it would wait for ever.
    """

    def __init__(self) -> None:
        self._guard = threading.Lock()
        self._waiting: deque[threading.Lock] = deque()
        self._held = False
        self._holder: int | None = None  # the thread
        self.turns = 0  # how often it was taken

    @property
    def held(self) -> bool:
        return self._held

    @property
    def holder(self) -> int | None:
        """The thread that holds it; None also in the moment in which it is handed over."""
        return self._holder

    def __enter__(self) -> None:
        thread = threading.get_ident()
        if self._holder == thread:
            raise RuntimeError("this thread holds the simulator's lock already")
        self._take()
        self._holder = thread
        self.turns += 1

    def _take(self) -> None:
        with self._guard:
            if not self._held:
                self._held = True
                return
            turn = threading.Lock()
            turn.acquire()
            self._waiting.append(turn)
        turn.acquire()

    def wait(self, event: threading.Event, timeout: float) -> None:
        """Lets go of the lock until `event` is set, or for `timeout` [s]; for the holder."""
        self.__exit__(None, None, None)
        event.wait(timeout)
        self.__enter__()

    def yield_turn(self) -> None:
        """Lets everybody who waits have their turn first; for the holder, in the middle of long work."""
        self.__exit__(None, None, None)
        self.__enter__()

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._holder = None
        with self._guard:
            if self._waiting:
                self._waiting.popleft().release()  # the lock stays held: it is handed over
            else:
                self._held = False
