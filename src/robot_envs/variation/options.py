"""The options of a randomisation: what each may be, and what a user has given, checked."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from bullet_gazebo.state import did_you_mean
from robot_envs.variation.numbers import by_name, is_number


class Kind(NamedTuple):
    """What has something that is drawn: links, joints or controllers, and which of them."""

    name: str
    which: str


LINKS = Kind("link", "that moves and has a mass")
SOLIDS = Kind("link", "with a collision")
JOINTS = Kind("joint", "that moves")
CONTROLLERS = Kind("controller", "with a PID")
WORLD = Kind("world", "")


class Option(NamedTuple):
    """One thing that is drawn for each link, joint or controller, or for the world.

    Args:
        name: of the option.
        of: what has it.
        least: that may be drawn.
        most: that may be drawn.
        nominal: what a robot has that doesn't differ.
        numbers: of it, for each.
        either_way: whether a single number is a half-width about the nominal one, not the most.
    """

    name: str
    of: Kind
    least: float
    most: float
    nominal: float = 1.0
    numbers: int = 1
    either_way: bool = True


OPTIONS = (  # in the order in which numbers are drawn: new ones go to the end
    Option("mass", LINKS, 0.1, 10.0),
    Option("length", LINKS, 0.1, 10.0),
    Option("com", LINKS, -10.0, 10.0, nominal=0.0, numbers=3),
    Option("damping", JOINTS, 0.0, 1e6, nominal=0.0, either_way=False),
    Option("friction", JOINTS, 0.0, 1e6, nominal=0.0, either_way=False),
    Option("surface_friction", SOLIDS, 0.1, 10.0),
    Option("gains", CONTROLLERS, 0.1, 10.0),
    Option("gravity", WORLD, 0.0, 10.0),
)
ROUNDING = 1e-9  # 1 - 0.9 is a little less than 0.1


class Range(NamedTuple):
    """From what is drawn, uniformly."""

    low: float
    high: float

    def at(self, share: float) -> float:
        """The value at a share of the way from low to high."""
        return self.low + (self.high - self.low) * share


def check_names(given: Iterable[str]) -> None:
    """Refuses options that there are none of.

    Raises:
        ValueError: naming the nearest one.
    """
    known = [option.name for option in OPTIONS]
    for name in given:
        if name not in known:
            hint = did_you_mean(str(name), known) or f"; there are {', '.join(known)}"
            raise ValueError(f"randomisation has no option {name!r}{hint}")


def ranges(option: Option, given: Any, names: Sequence[str]) -> dict[str, Range]:
    """What is drawn for which of `names`.

    Args:
        option: whose.
        given: a number, a pair (low, high), or a mapping with either by name.
        names: of what has it.

    Raises:
        ValueError: for what it can't be, or a name that isn't there.
    """
    if not names:
        raise ValueError(
            f"randomisation of {option.name}: the robot has no {option.of.name} {option.of.which}"
        )
    if not isinstance(given, Mapping):
        return dict.fromkeys(names, _range(option, given, option.name))
    if option.of == WORLD:
        raise ValueError(f"randomisation of {option.name} is one for the world, not {dict(given)}")
    found = by_name(f"randomisation of {option.name}", given, names, *option.of)
    return {
        name: _range(option, value, f"{option.name} of '{name}'") for name, value in found.items()
    }


def _range(option: Option, given: Any, what: str) -> Range:
    numbers = list(given) if isinstance(given, (Sequence, np.ndarray)) else [given]
    if len(numbers) not in (1, 2) or not all(map(is_number, numbers)):
        raise ValueError(
            f"randomisation of {what} is a number or a pair (low, high), not {given!r}"
        )
    if len(numbers) == 1:
        size = numbers[0]
        if size < 0.0:
            raise ValueError(
                f"randomisation of {what} is one number: it must be >= 0, not {given!r}"
            )
        numbers = [option.nominal - size * option.either_way, option.nominal + size]
    low, high = map(float, numbers)
    least, most = option.least, option.most
    if not least - ROUNDING <= low <= high <= most + ROUNDING:
        raise ValueError(
            f"randomisation of {what} from {low:g} to {high:g}: it must lie within {least:g} and {most:g}, "
            "the lower number first"
        )
    return Range(max(low, least), min(high, most))
