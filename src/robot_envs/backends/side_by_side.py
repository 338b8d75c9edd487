"""Simulators of one's own that start, and end, side by side."""

import contextlib
from collections.abc import Callable, Iterator
from contextvars import ContextVar
from typing import NamedTuple, Protocol


class Starting(Protocol):
    """A world whose simulator was only begun to be started."""

    def connect(self) -> None:
        """Waits until it can be used."""
        ...

    def close(self) -> None:
        """Gives it up."""
        ...


class Place(NamedTuple):
    """Which one of how many that start side by side, from 1 on."""

    number: int = 1
    of: int = 1

    def __str__(self) -> str:
        return "the simulator" if self.of == 1 else f"simulator {self.number} of {self.of}"


class _Group:
    """What is under way in a block."""

    def __init__(self, count: int) -> None:
        self.count = count
        self.starting: list[Starting] = []
        self.ends: list[Callable[[], object]] = []


_present: ContextVar[_Group | None] = ContextVar("simulators", default=None)


@contextlib.contextmanager
def side_by_side(count: int) -> Iterator[None]:
    """Within the block simulators of one's own only begin to start, and to end; its end waits for all.

    Where one doesn't start all of the block are ended, and the first error is raised.

    Args:
        count: how many will start; they are refused at once where there isn't the memory for all.
    """
    group = _Group(count)
    token = _present.set(group)
    try:
        try:
            yield
            for world in group.starting:
                world.connect()
        except BaseException:  # Ctrl-C, too
            for world in group.starting:
                world.close()
            raise
        finally:
            for wait in group.ends:
                wait()
    finally:
        _present.reset(token)


def next_place() -> Place:
    """That of the world that begins to start now."""
    group = _present.get()
    return Place() if group is None else Place(len(group.starting) + 1, group.count)


def connect(world: Starting) -> None:
    """Connects a world that was begun to be started: now, or at the end of the block."""
    group = _present.get()
    if group is None:
        world.connect()
    else:
        group.starting.append(world)


def wait_for_end(wait: Callable[[], object]) -> None:
    """Waits for the end of what was told to end: now, or at the end of the block."""
    group = _present.get()
    if group is None:
        wait()
    else:
        group.ends.append(wait)
