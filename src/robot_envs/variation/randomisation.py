"""Domain randomisation of any robot, from named options."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from robot_envs.scene import Scene
from robot_envs.variation.options import (
    CONTROLLERS,
    JOINTS,
    LINKS,
    OPTIONS,
    SOLIDS,
    WORLD,
    Option,
    Range,
    check_names,
    ranges,
)
from robot_envs.variation.parts import Parts, check_tunable
from robot_envs.variation.variation import LinkScale, Variation

Drawn = dict[str, Any]
"""What was drawn: by option, and by the name of the link, joint or controller."""


class UniformRandomisation:
    """Draws a robot for each episode, uniformly, as options say.

    | option | of each | what differs | a number means |
    |---|---|---|---|
    | `mass` | link | factor of its mass and moments | half-width: 0.2 is 0.8 to 1.2 |
    | `length` | link | factor of the way to its centre of mass, and of what goes with it | half-width |
    | `com` | link | its centre of mass [m], each of x, y and z | half-width |
    | `damping` | joint | viscous friction [N s/m, N m s/rad] beside its own | most |
    | `friction` | joint | dry friction [N, N m] beside its own | most |
    | `surface_friction` | link | factor of the friction of its surfaces | half-width |
    | `gains` | controller | factor of p, i and d of its PIDs | half-width |
    | `gravity` | the world | factor of its gravity | half-width |

    Instead of the number there may be a pair (low, high), or a mapping with either by name, for some links,
    joints or controllers only.

    A robot takes as many random numbers whatever is asked for, so that streams don't depend on it.

    Args:
        scene: whose links, joints and controllers are meant; their names are those that a state has for
            joints, and commands for controllers.
        options: by name.

    Raises:
        ValueError: for an option, name or range that there can't be.
        RobotEnvError: if something in a robot's description is wrong.
    """

    def __init__(self, scene: Scene, options: Mapping[str, Any]) -> None:
        check_names(options)
        parts = Parts(scene)
        self._axes = parts.axes
        pids = parts.pids() if "gains" in options else {}
        drawn_for = {
            LINKS: parts.axes, SOLIDS: parts.solids, JOINTS: parts.joints,
            CONTROLLERS: parts.controllers, WORLD: (WORLD.name,),
        }  # fmt: skip
        self._ranges: dict[str, dict[str, Range]] = {}
        self._places: dict[str, dict[str, int]] = {}  # of the options' numbers among those drawn
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
        tuned = self._ranges.get("gains", {})
        check_tunable(pids, {name: span.high for name, span in tuned.items()})

    def draw(self, rng: np.random.Generator) -> tuple[Variation, Drawn]:
        """Draws one robot; what was drawn comes with it, by option and name."""
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
        return variation, {name: _told(value) for name, value in drawn.items()}

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
        given = {
            key: drawn[key][link] for key in ("mass", "length", "com") if link in drawn.get(key, ())
        }
        return LinkScale(**given, axis=self._axes[link])


def _check_whole(option: Option, given: Any, lumped: Mapping[str, str]) -> None:
    """Says where a link has gone that isn't one in the physics."""
    if isinstance(given, Mapping) and option.of in (LINKS, SOLIDS):
        for name in given:
            if name in lumped:
                raise ValueError(
                    f"randomisation of {option.name}: a fixed joint makes link '{name}' part of "
                    f"'{lumped[name]}'; name that one"
                )


def _told(drawn: Any) -> Any:
    """A copy, with arrays for what has several numbers, which vectors of environments can stack."""
    if not isinstance(drawn, Mapping):
        return drawn
    return {
        name: np.array(value) if isinstance(value, tuple) else value
        for name, value in drawn.items()
    }
