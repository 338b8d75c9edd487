"""glibc's heap: free memory goes back to the system. Other C libraries are left alone."""

import ctypes

ARENA_MAX = -8  # mallopt's M_ARENA_MAX


def give_back() -> None:
    """Returns free memory to the system, which the C library would keep for later."""
    getattr(ctypes.CDLL(None), "malloc_trim", lambda _: None)(0)


def use_one_arena() -> None:
    """Makes all threads share one heap. Call it before there is a second thread.

    By default glibc makes up to eight heaps a core, and each keeps its free memory. Python's threads
    allocate one after the other anyway.
    """
    getattr(ctypes.CDLL(None), "mallopt", lambda *_: None)(ARENA_MAX, 1)
