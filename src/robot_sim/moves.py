"""Moves of bodies by services and resets, and their listeners."""

from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager

from robot_sim.physics.model import Model
from robot_sim.physics.world import World

NEAR = 1e-3  # [m, rad / 2] by which attached links may be off
Moved = Collection[Model] | None
"""The models that were moved, with what is attached to them; None for all, after a reset."""


class Moves:
    """Notifies listeners of moves. The caller of each method holds the simulator's lock."""

    def __init__(self, world: World) -> None:
        self._world = world
        self.listeners: list[Callable[[Moved], None]] = []
        self._open = 0  # blocks of `as_one`
        self._pending: Moved = ()

    def tell(self, moved: Moved) -> None:
        """Notifies of a move; within a block, of all its moves at its end."""
        pending = self._pending
        pending = None if moved is None or pending is None else {*pending, *moved}
        self._pending = pending if self._open else ()
        if self._open == 0 and pending != set():
            found = pending
            if pending is not None:
                _carry(self._world, pending)
                found = self._world.with_attached(pending)
            for listener in self.listeners:
                listener(found)

    @contextmanager
    def as_one(self) -> Iterator[None]:
        """Merges all moves in the block into one notification at its end."""
        self._open += 1
        try:
            yield
        finally:
            self._open -= 1
            self.tell(())

    def on_move_of(self, model: Model, call: Callable[[], None]) -> Callable[[Moved], None]:
        """Calls a function after each move of a model or of all; returns the listener, for `forget`."""

        def listener(moved: Moved) -> None:
            if moved is None or model in moved:
                call()

        # A new list: the old one may be in use by whoever forgets a listener.
        self.listeners = [*self.listeners, listener]
        return listener

    def forget(self, listener: Callable[[Moved], None]) -> None:
        self.listeners = [each for each in self.listeners if each is not listener]


def _carry(world: World, moved: Collection[Model]) -> None:
    """Moves attached models along; detaches models that are fixed or were moved themselves."""
    stay, waiting = set(moved), list(moved)
    while waiting:
        model = waiting.pop()
        for each in [attachment for attachment in world.attachments if attachment.joins(model)]:
            (one, link), (other, its) = each.first, each.second
            pose, wanted = other.link_state(its)[0], one.link_state(link)[0].compose(each.pose)
            gap = pose.relative_to(wanted)
            off = max(map(abs, (*gap.position, *gap.orientation[:3])))
            if one is other or off < NEAR:
                continue
            if model is other:
                wanted, pose = pose.compose(each.pose.inverse()), one.link_state(link)[0]
                other = one
            if other in stay or other.description.fixed_base:
                world.detach(each)
                continue
            other.place(wanted.compose(other.state()[0].relative_to(pose)))
            stay.add(other)
            waiting.append(other)
