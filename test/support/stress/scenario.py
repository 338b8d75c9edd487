"""A scenario: many cases drawn from one seed, all tried and counted in a row of the table."""

from __future__ import annotations

import random
import subprocess
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

ENOUGH = 5  # failures, after which no further case is begun

Case = Callable[[int, random.Random], None]


@dataclass
class Row:
    """What the table says of a scenario: its notes are figures such as the memory before and after."""

    name: str
    done: int = 0
    failures: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    seconds: float = 0.0


class Scenario:
    """Hands a stress test its share of the cases (`scale`), its random numbers (`seed`), and its row.

    Of each scenario it tries the case `only` alone, to see a failure again, or all if that is None.
    """

    def __init__(self, seed: int, scale: float, only: int | None = None) -> None:
        self.seed, self.scale, self._only = seed, scale, only
        self.rows: list[Row] = []

    def share(self, count: int) -> int:
        """How many of so many things are done at this scale, at least one."""
        return max(1, round(count * self.scale))

    def dice(self, name: str, number: int) -> random.Random:
        """The random numbers of one case, whichever others were tried before."""
        return random.Random(f"{self.seed}/{name}/{number}")

    def run(self, name: str, count: int, case: Case, lanes: int = 1, unit: int = 1) -> Row:
        """Tries `count` cases at full scale, in `lanes` threads; fails in the end, with all that failed.

        A case gets its number and its random numbers; it counts for `unit`s of what the row counts.
        """
        __tracebackhide__ = True
        row, begin = Row(name), time.monotonic()
        self.rows.append(row)

        def attempt(number: int) -> None:
            if len(row.failures) >= ENOUGH:
                return
            row.done += unit
            try:
                case(number, self.dice(name, number))
            except (AssertionError, subprocess.TimeoutExpired) as fault:
                row.failures.append(f"case {number} of seed {self.seed}: {fault}")

        numbers = range(self.share(count)) if self._only is None else [self._only]
        try:
            if lanes == 1:  # in this thread, to which a master may belong
                for number in numbers:
                    attempt(number)
            else:
                with ThreadPoolExecutor(lanes) as pool:
                    list(pool.map(attempt, numbers))
        except BaseException as fault:
            row.failures.append(f"broken off: {type(fault).__name__}: {fault}")
            raise
        finally:
            row.seconds = time.monotonic() - begin
        assert not row.failures, "\n\n".join([f"{name}: {len(row.failures)} failed", *row.failures])
        return row
