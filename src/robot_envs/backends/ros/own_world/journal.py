"""What a simulator was told since the episode's begin: enough to bring another one to the same state."""

from array import array
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields
from typing import Any

from robot_envs.variation import Variation
from robot_envs.world_state import Commands, InitialState, WorldState


@dataclass
class _Part:
    """Steps that commanded the same controllers."""

    names: tuple[str, ...]
    sizes: tuple[int | None, ...]  # how many numbers each takes; None: a plain one
    steps: int = 0
    numbers: "array[float]" = field(default_factory=lambda: array("d"))


class Journal:
    """An episode's begin and its commands, at 8 bytes for each number."""

    def __init__(self) -> None:
        self.initial: InitialState | None = None  # None: no episode has begun
        self.last: WorldState | None = None
        self.steps = 0
        self._parts: list[_Part] = []

    def clear(self) -> None:
        """Forgets the episode."""
        self.initial = self.last = None
        self.steps = 0
        self._parts = []

    def begin(self, initial: InitialState, state: WorldState) -> None:
        """Notes an episode's begin, and the state reached."""
        self.clear()
        self.initial, self.last = initial, state

    def add(self, commands: Commands, state: WorldState) -> None:
        """Notes commands, and the state a control period later."""
        self.steps += 1
        self.last = state
        names, values = tuple(commands), tuple(commands.values())
        sizes = tuple([None if type(each) is float else _size(each) for each in values])
        part = self._parts[-1] if self._parts else None
        if part is None or part.names != names or part.sizes != sizes:
            part = _Part(names, sizes)
            self._parts.append(part)
        part.steps += 1
        for value in values:
            if isinstance(value, (int, float)):
                part.numbers.append(value)
            else:
                part.numbers.extend(value)

    def commands(self) -> Iterator[dict[str, Any]]:
        """Those of each step, in order."""
        for part in self._parts:
            following = iter(part.numbers)
            for _ in range(part.steps):
                yield {
                    name: next(following)
                    if size is None
                    else tuple(next(following) for _ in range(size))
                    for name, size in zip(part.names, part.sizes, strict=True)
                }


def _size(value: Any) -> int | None:
    return None if isinstance(value, (int, float)) else len(value)


def merged(before: Variation, variation: Variation) -> Variation:
    """What holds after both: what a variation doesn't name stays as the one before left it."""
    given: dict[str, Any] = {}
    for each in fields(Variation):
        old, new = getattr(before, each.name), getattr(variation, each.name)
        both = isinstance(old, Mapping) and isinstance(new, Mapping)
        given[each.name] = {**old, **new} if both else old if new is None else new
    return Variation(**given)
