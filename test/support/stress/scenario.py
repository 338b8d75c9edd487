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
    """What the table says of a scenario.

    Args:
        name: what was done, in the words of the table.
        done: those that were tried.
        failures: what went wrong, and in which case.
        notes: figures besides, such as the memory before and after.
        seconds: of wall time.
    """

    name: str
    done: int = 0
    failures: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    seconds: float = 0.0


class Scenario:
    """Hands a stress test its share of the cases, its random numbers, and its row.

    Args:
        seed: of all that is drawn.
        scale: part of the cases that is tried.
        only: the one case to try, to see a failure again; None: all.
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
        """Tries the cases, in so many threads; a case that fails keeps none of the others from it.

        Args:
            name: see `Row`.
            count: cases at full scale.
            case: gets its number and its random numbers; an assertion tells what doesn't hold.
            lanes: cases that go on at a time.
            unit: what a case counts for, where it holds several of what the row counts.

        Raises:
            AssertionError: with all failures, in the end.
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
