"""Domain randomisation of any robot, from named options."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from file_access.text import nearest_or_all
from robot_envs.scene import Scene
from robot_envs.variation.imperfections import by_name, is_number
from robot_envs.variation.parts import Parts
from robot_envs.variation.variation import LinkScale, Variation
from robot_sim.state_dict import Shared


class Kind(NamedTuple):
    """What a number is drawn for: links, joints, controllers or the world, and which of them."""

    name: str
    which: str


LINKS = Kind("link", "that moves and has a mass")
SOLIDS = Kind("link", "with a collision")
JOINTS = Kind("joint", "that moves")
CONTROLLERS = Kind("controller", "with a PID")
WORLD = Kind("world", "")


class Option(NamedTuple):
    """An option of a randomisation."""

    name: str
    of: Kind  # what a number is drawn for
    least: float  # smallest value that may be drawn
    most: float  # largest value that may be drawn
    nominal: float = 1.0  # of a robot that isn't varied
    numbers: int = 1  # how many are drawn for each
    # Whether a single number is a half-width about the nominal value, or else the largest.
    either_way: bool = True


OPTIONS = (  # in the order of drawing, which changes results: append new ones at the end
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


class UniformRange(NamedTuple):
    """The bounds between which a number is drawn, uniformly."""

    low: float
    high: float

    def at(self, share: float) -> float:
        """Returns the value at a share of the way from low to high, 0 to 1."""
        return self.low + (self.high - self.low) * share


def ranges(option: Option, given: Any, names: Sequence[str]) -> dict[str, UniformRange]:
    """Returns an option's intervals by name, from a number, a pair (low, high), or a mapping of these."""
    if not names:
        raise ValueError(
            f"randomisation of {option.name}: the robot has no {option.of.name} {option.of.which}"
        )
    if not isinstance(given, Mapping):
        return dict.fromkeys(names, _range(option, given, option.name))
    if option.of == WORLD:
        raise ValueError(f"randomisation of {option.name} is one for the world, not {dict(given)}")
    values = by_name(f"randomisation of {option.name}", given, names, *option.of)
    return {name: _range(option, value, f"{option.name} of '{name}'") for name, value in values.items()}


def _range(option: Option, given: Any, what: str) -> UniformRange:
    numbers = list(given) if isinstance(given, (Sequence, np.ndarray)) else [given]
    if len(numbers) not in (1, 2) or not all(map(is_number, numbers)):
        raise ValueError(f"randomisation of {what} is a number or a pair (low, high), not {given!r}")
    if len(numbers) == 1:
        size = numbers[0]
        if size < 0.0:
            raise ValueError(f"randomisation of {what} is one number: it must be >= 0, not {given!r}")
        numbers = [option.nominal - size * option.either_way, option.nominal + size]
    low, high = map(float, numbers)
    least, most = option.least, option.most
    if not least - ROUNDING <= low <= high <= most + ROUNDING:
        raise ValueError(
            f"randomisation of {what} from {low:g} to {high:g}: it must lie within {least:g} and {most:g}, "
            "the lower number first"
        )
    return UniformRange(max(low, least), min(high, most))


Drawn = dict[str, Any]
"""What was drawn: by option, and by the name of the link, joint or controller."""


class UniformRandomisation(Shared):
    """Draws a robot for each episode, uniformly, within the bounds of its options (docs/sim_to_real.md).

    A value is a number, a pair (low, high), or a mapping with either by name, for some links, joints or
    controllers only; names are as in `Parts`. The same count of random numbers is drawn whatever the options,
    so that later draws don't depend on them. Raises ValueError for an unknown option or name, or an
    impossible interval.
    """

    def __init__(self, scene: Scene, options: Mapping[str, Any]) -> None:
        known = [option.name for option in OPTIONS]
        for name in options:
            if name not in known:
                hint = nearest_or_all(str(name), known)
                raise ValueError(f"randomisation has no option {name!r}{hint}")
        parts = Parts(scene)
        self._axes = parts.axes
        pids = parts.pids() if "gains" in options else {}
        drawn_for = {
            LINKS: parts.axes, SOLIDS: parts.solids, JOINTS: parts.joints,
            CONTROLLERS: parts.controllers, WORLD: (WORLD.name,),
        }  # fmt: skip
        self._ranges: dict[str, dict[str, UniformRange]] = {}
        # Indices of an option's numbers among those drawn.
        self._places: dict[str, dict[str, int]] = {}
        self._count = 0
        for option in OPTIONS:
            names = list(drawn_for[option.of])
            self._places[option.name] = {
                name: self._count + option.numbers * index for index, name in enumerate(names)
            }
            self._count += option.numbers * len(names)
            if option.name in options:
                _check_whole(option, options[option.name], parts.lumped)
                able = list(pids) if option.of == CONTROLLERS else names
                self._ranges[option.name] = ranges(option, options[option.name], able)

    def draw(self, rng: np.random.Generator) -> tuple[Variation, Drawn]:
        """Draws a variation; returns it, and the numbers by option and name."""
        shares = rng.random(self._count).tolist()
        drawn: Drawn = {}
        for option in OPTIONS:
            if option.name in self._ranges:
                drawn[option.name] = self._drawn(option, shares)
        links = {name for key in ("mass", "length", "com") for name in drawn.get(key, ())}
        variation = Variation(
            {name: self._scale(name, drawn) for name in self._axes if name in links},
            drawn.get("damping", {}),
            drawn.get("friction", {}),
            drawn.get("surface_friction", {}),
            drawn.get("gains", {}),
            drawn.get("gravity"),
        )
        return variation, {name: _reported(value) for name, value in drawn.items()}

    def _drawn(self, option: Option, shares: Sequence[float]) -> Any:
        places, several = self._places[option.name], option.numbers
        if option.of == WORLD:
            return self._ranges[option.name][WORLD.name].at(shares[places[WORLD.name]])
        return {
            name: span.at(shares[places[name]])
            if several == 1
            else tuple(span.at(share) for share in shares[places[name] : places[name] + several])
            for name, span in self._ranges[option.name].items()
        }

    def _scale(self, link: str, drawn: Drawn) -> LinkScale:
        given = {key: drawn[key][link] for key in ("mass", "length", "com") if link in drawn.get(key, ())}
        return LinkScale(**given, axis=self._axes[link])


def _check_whole(option: Option, given: Any, lumped: Mapping[str, str]) -> None:
    """Raises ValueError for a link that the physics merge into another one, and names that one."""
    if isinstance(given, Mapping) and option.of in (LINKS, SOLIDS):
        for name in given:
            if name in lumped:
                raise ValueError(
                    f"randomisation of {option.name}: a fixed joint makes link '{name}' part of "
                    f"'{lumped[name]}'; name that one"
                )


def _reported(drawn: Any) -> Any:
    """Returns a copy with arrays for several numbers, which vectors of environments can stack."""
    if not isinstance(drawn, Mapping):
        return drawn
    return {name: np.array(value) if isinstance(value, tuple) else value for name, value in drawn.items()}
