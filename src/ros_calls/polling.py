"""Polling before sleeping, at both ends of a connection on which one message follows the other.

A thread that sleeps leaves its core to sleep, too. In a virtual machine waking both may take longer than the
answer that is waited for.
"""

from __future__ import annotations

import math
import os
import time
from collections import deque
from collections.abc import Callable
from functools import cache

SWITCH = "LOCKSTEP_POLLING"  # environment variable: 0 has nothing polled in a process
LONGEST = 0.001  # [s]; what takes longer is slept for
SHORTEST = 0.00005  # [s]; for waits that were next to nothing
RECENT = 4  # waits that tell how long the next one may be
LOST = 0.0001  # [s] between two looks: somebody else had the core, or Python's lock
FIRST_REST, LONGEST_REST = 8, 1024  # waits that aren't polled after a poll that was in vain
FORGIVEN = 8  # polls that were worth it, after which the next rest is half as long again


class AdaptivePoll:
    """Polls before a thread sleeps; one for each end of a connection.

    Each wait lies between `before` and `after`. It is polled for twice as long as the longest of the last few
    took, unless one of them took longer than LONGEST: so nothing is polled where nothing comes. Neither is it
    while more threads want to run on this machine than this process may use cores. The core is offered to
    others between two looks. When one keeps it, or nothing has come in time, waits to come are slept for:
    eight, and twice as many each time.
    """

    def __init__(self, clock: Callable[[], float] = time.perf_counter) -> None:
        """`clock` [s]."""
        self._clock = clock
        self._waits = deque([math.inf] * RECENT, maxlen=RECENT)  # [s]
        self._begin = 0.0  # [s]
        self._cores = 0 if is_off() else cores()
        self._rest = 0
        self._next_rest = FIRST_REST
        self._worth = 0  # polls, since a rest was made shorter
        self.looks = 0  # that have been taken: for who wants to know what polling costs

    def before(self, ready: Callable[[], object]) -> None:
        """Polls, if that is likely to be worth it; to be called when a wait begins.

        Args:
            ready: says at once whether there is what is waited for.
        """
        self._begin = begin = self._clock()
        if self._rest > 0:
            self._rest -= 1
            return
        expected = max(self._waits)
        if expected > LONGEST or self._cores < 2 or running() > self._cores:
            return
        end = begin + max(SHORTEST, min(2.0 * expected, LONGEST))
        looked = begin
        while True:
            self.looks += 1
            found = ready()
            now = self._clock()
            if now - looked > LOST or (now >= end and not found):
                self._give_up()
                return
            if found:
                self._count_worth()
                return
            looked = now
            os.sched_yield()

    def after(self) -> None:
        """To be called when what was waited for has come."""
        self._waits.append(self._clock() - self._begin)

    def _give_up(self) -> None:
        self._worth = 0
        self._rest = self._next_rest
        self._next_rest = min(2 * self._next_rest, LONGEST_REST)

    def _count_worth(self) -> None:
        self._worth += 1
        if self._worth >= FORGIVEN:
            self._worth = 0
            self._next_rest = max(self._next_rest // 2, FIRST_REST)


def is_off() -> bool:
    """Whether somebody has switched it off for this process."""
    return os.environ.get(SWITCH) == "0"


def cores() -> int:
    """How many cores this process may use."""
    return len(os.sched_getaffinity(0))


def running() -> float:
    """How many threads of this machine run or want to, the one that asks among them.

    In a container, too, it is those of the whole machine. Where that can't be told it is infinity.
    """
    try:
        return int(os.pread(_load_file(), 128, 0).split()[3].partition(b"/")[0])
    except (OSError, ValueError, IndexError):
        return math.inf


@cache
def _load_file() -> int:
    """The kernel's file that tells how many threads run, open for as long as the process lives."""
    return os.open("/proc/loadavg", os.O_RDONLY)
