"""Moves of bodies by something other than time, and who is told of them."""

from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager

from bullet_gazebo.physics.model import Model
from bullet_gazebo.physics.world import World

Moved = Collection[Model] | None
"""The models that were moved, with what is attached to them; None for all, after a reset."""


class Moves:
    """Tells of moves. The caller of each method holds the simulator's lock."""

    def __init__(self, world: World) -> None:
        self._world = world
        self.listeners: list[Callable[[Moved], None]] = []
        self._open = 0  # blocks of `as_one`
        self._pending: Moved = ()

    def tell(self, moved: Moved) -> None:
        """Tells of a move, or of all of a block's at its end."""
        pending = self._pending
        pending = None if moved is None or pending is None else {*pending, *moved}
        self._pending = pending if self._open else ()
        if self._open == 0 and pending != set():
            found = None if pending is None else self._world.with_attached(pending)
            for listener in self.listeners:
                listener(found)

    @contextmanager
    def as_one(self) -> Iterator[None]:
        """Tells of all moves in the block at its end, as one."""
        self._open += 1
        try:
            yield
        finally:
            self._open -= 1
            self.tell(())

    def on_move_of(self, model: Model, call: Callable[[], None]) -> Callable[[Moved], None]:
        """Calls a function when a model was moved, or all were; returns the listener, for `forget`."""

        def listener(moved: Moved) -> None:
            if moved is None or model in moved:
                call()

        # A new list: the old one may be in use by whoever forgets a listener.
        self.listeners = [*self.listeners, listener]
        return listener

    def forget(self, listener: Callable[[Moved], None]) -> None:
        self.listeners = [each for each in self.listeners if each is not listener]
