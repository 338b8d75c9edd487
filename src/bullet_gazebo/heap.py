"""The C library's heap: what is free goes back to the system. Without effect where it isn't glibc's."""

import ctypes

ARENA_MAX = -8  # mallopt's M_ARENA_MAX


def give_back() -> None:
    """Gives back what is free in the heap, which the C library would keep for later."""
    function = _function("malloc_trim")
    if function is not None:
        function(0)


def use_one_arena() -> None:
    """Has all threads use one heap; to be called before there is a second thread.

    Else each of some eight for every core keeps what was free in it once, and Python's threads allocate in
    turn anyhow.
    """
    function = _function("mallopt")
    if function is not None:
        function(ARENA_MAX, 1)


def _function(name: str) -> "ctypes._NamedFuncPointer | None":
    return getattr(ctypes.CDLL(None), name, None)
