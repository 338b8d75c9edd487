"""Keeps simulated time in step with the wall clock."""

import math
import time

MAX_LAG = 0.1  # [s]; a host that falls behind further than this isn't made up for


class Pacer:
    """Waits until the wall clock has caught up with the ticks done so far."""

    def __init__(self) -> None:
        self._due = time.perf_counter()

    def restart(self) -> None:
        """Begins to count from now, after a pause."""
        self._due = time.perf_counter()

    def wait(self, period: float, longest: float = math.inf) -> bool:
        """Sleeps until `period` [s of wall time] after the previous due time; 0 never waits.

        Returns:
            False when that takes longer than `longest` [s]: call wait_on() until it is due.
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
