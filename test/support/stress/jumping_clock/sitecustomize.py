"""With this folder on PYTHONPATH, the wall clock of any Python process jumps by hours.

As a clock that is set, or set right over the network; the clocks that only measure spans go on evenly. Not in
roslaunch and master, which give up what they wait for when it jumps.
"""

import os
import random
import sys
import time

EXEMPT = ("roslaunch", "roscore", "rosmaster")
RARE = 0.02  # of the looks at the clock come after a jump
HOUR = 3600.0  # [s]


class JumpingClock:
    """`time.time`, and what is derived from it; the seed is of when and where to it jumps."""

    def __init__(self, seed: str) -> None:
        self._dice, self._time, self._offset = random.Random(seed), time.time, 0.0

    def time(self) -> float:
        if self._dice.random() < RARE:
            self._offset = self._dice.choice([0.0, 30 * HOUR, -30 * HOUR, HOUR, -1.0, 0.5])
        return self._time() + self._offset

    def time_ns(self) -> int:
        return int(self.time() * 1e9)


if not any(word.endswith(EXEMPT) for word in sys.orig_argv):
    clock = JumpingClock(os.environ.get("STRESS_CLOCK", "0"))
    time.time, time.time_ns = clock.time, clock.time_ns
