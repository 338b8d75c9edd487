"""Keeps simulated time in step with the wall clock."""

import time

MAX_LAG = 0.1  # [s]; a host that falls behind further than this isn't made up for


class Pacer:
    """Waits until the wall clock has caught up with the ticks done so far."""

    def __init__(self) -> None:
        self._due = time.perf_counter()

    def restart(self) -> None:
        """Begins to count from now, after a pause."""
        self._due = time.perf_counter()

    def wait(self, period: float) -> None:
        """Sleeps until `period` [s of wall time] after the previous due time; 0 never waits."""
        self._due += period
        delay = self._due - time.perf_counter()
        if period <= 0.0 or delay < -MAX_LAG:
            self._due = time.perf_counter()
        elif delay > 0.0:
            time.sleep(delay)
