"""The memory that a process keeps: resident pages after free ones were given back."""

import ctypes
import gc
import os
from collections.abc import Callable
from pathlib import Path

_LIBC = ctypes.CDLL("libc.so.6")
ROUNDS = 3
_PAGE = os.sysconf("SC_PAGE_SIZE")


def resident(pid: int | str = "self") -> int:
    """Resident memory [bytes] of a process, as it is."""
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * _PAGE


def kept() -> int:
    """Resident memory [bytes] of this process, without what is merely free."""
    gc.collect()
    _LIBC.malloc_trim(0)
    return resident()


def growth(action: Callable[[int], None], cycles: int, warm_up: int) -> int:
    """What this process keeps [bytes] of `cycles` calls of `action` with their numbers, after `warm_up`."""
    for cycle in range(warm_up):
        action(cycle)
    before = kept()
    for cycle in range(warm_up, warm_up + cycles):
        action(cycle)
    return kept() - before


def stays(action: Callable[[int], None], cycles: int, warm_up: int, most: int) -> bool:
    """Whether `cycles` calls keep less than `most` [bytes] in one of some rounds.

    What is kept of each call is kept in each round. What comes once is not: a thread of another test, pages
    that the allocator gives back late.
    """
    return any(growth(action, cycles, warm_up if number == 0 else 0) < most for number in range(ROUNDS))
