"""How long workers may take; where a part takes any time, what others took tells it."""

import math
import time

BEGINNING = 15.0  # [s] after which the user hears of workers that haven't begun
DEADLINE = 180.0  # [s] at least until a silent one is replaced; twice that each further time
TIMES = 10.0  # as long as the longest part took so far


class Deadlines:
    """Of the workers of one training.

    Args:
        count: of workers.
    """

    def __init__(self, count: int) -> None:
        self._asked = [0.0] * count  # when each was [s of the monotonic clock]
        self._longest = 0.0  # [s] that a part took so far; 0: none was played yet

    def ask(self, index: int) -> None:
        """A worker is asked now."""
        self._asked[index] = time.monotonic()

    def played(self, index: int) -> None:
        """A worker has played what it was asked to."""
        self._longest = max(self._longest, self.since(index))

    def since(self, index: int) -> float:
        """Seconds since a worker was asked."""
        return time.monotonic() - self._asked[index]

    def limit(self, begins: bool, losses: int) -> float:
        """Seconds after which one is replaced.

        Args:
            begins: whether it is to begin; else it plays.
            losses: of workers at the same part; each doubles the time, so that a part which only takes
                long is played to its end.
        """
        if begins:
            return DEADLINE * 2**losses
        if not self._longest:  # nobody knows
            return math.inf
        return max(DEADLINE, TIMES * self._longest) * 2**losses

    def silence(self, begins: bool) -> float:
        """Seconds after which the user hears of one."""
        return BEGINNING if begins else max(DEADLINE, TIMES * self._longest) / 2
