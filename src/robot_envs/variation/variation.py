"""Variations of a robot, and their effect on a link's inertia."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any, NamedTuple, Protocol

import numpy as np

from robot_sim.physics.description import Inertia
from robot_sim.physics.dynamics import tensor_in
from robot_sim.physics.pose import IDENTITY, ZERO, Vector, conjugate


class LinkScale(NamedTuple):
    """How a link's inertia differs.

    The length is measured along an axis of the link's frame: the distance of the centre of mass and the
    spread of the mass about it scale with it. Shapes and joints stay where they are.
    """

    mass: float = 1.0  # factor
    length: float = 1.0  # factor
    com: Vector = ZERO  # [m] displacement of the centre of mass, in the link's frame
    axis: str = "z"  # of the length


@dataclass(frozen=True)
class Variation:
    """What differs from the robot as it was made.

    Links, joints and controllers that aren't named stay as the variation before left them.

    Args:
        links: By the link's name.
        damping: Viscous friction that is added to a joint's own [N s/m, N m s/rad], by its name.
        friction: Dry friction that is added to a joint's own [N, N m], by its name.
        surfaces: Factors of a link's surface friction, by its name.
        gains: Factors of p, i and d of all PIDs of a controller, by its name; clamps stay.
        gravity: Factor of the world's; None: unchanged.
    """

    links: Mapping[str, LinkScale] = field(default_factory=dict)
    damping: Mapping[str, float] = field(default_factory=dict)
    friction: Mapping[str, float] = field(default_factory=dict)
    surfaces: Mapping[str, float] = field(default_factory=dict)
    gains: Mapping[str, float] = field(default_factory=dict)
    gravity: float | None = None

    @property
    def is_nominal(self) -> bool:
        """Whether nothing differs."""
        return self == self.undone

    def merged(self, later: "Variation") -> "Variation":
        """Both, one after the other: what `later` doesn't name stays."""
        given: dict[str, Any] = {}
        for each in fields(self):
            old, new = getattr(self, each.name), getattr(later, each.name)
            both = isinstance(old, Mapping) and isinstance(new, Mapping)
            given[each.name] = {**old, **new} if both else old if new is None else new
        return Variation(**given)

    @property
    def undone(self) -> "Variation":
        """The variation that undoes this one."""
        return Variation(
            {name: LinkScale(axis=scale.axis) for name, scale in self.links.items()},
            dict.fromkeys(self.damping, 0.0),
            dict.fromkeys(self.friction, 0.0),
            dict.fromkeys(self.surfaces, 1.0),
            dict.fromkeys(self.gains, 1.0),
            None if self.gravity is None else 1.0,
        )


class Randomisation(Protocol):
    """Draws the robot of each episode."""

    def draw(self, rng: np.random.Generator) -> tuple[Variation, Any]:
        """Draws a variation; returns it, and what the reset's `info["variation"]` reports."""


_ENTRIES = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}


def length_axis(inertia: Inertia) -> str:
    """Returns the axis of the link's frame along which its centre of mass lies furthest out."""
    x, y, z = (abs(value) for value in inertia.com.position)
    return "z" if z >= max(x, y) else "x" if x >= y else "y"


def scaled(inertia: Inertia, scale: LinkScale) -> Inertia:
    """Returns a link's inertia as a variation changes it, as if all its mass were stretched along the length.

    So the integral of z² over the mass scales with the square of a length along z, those of x² and y² don't.
    """
    index, turned = "xyz".index(scale.axis), inertia.com.orientation
    tensor = {key: getattr(inertia, key) for key in _ENTRIES}
    if scale.length != 1.0:
        straight = tensor_in(inertia, IDENTITY)  # the length is along one of the link's axes
        spread = np.trace(straight) / 2.0 * np.eye(3) - straight
        spread[index] *= scale.length
        spread[:, index] *= scale.length
        longer = Inertia(inertia.mass, **_entries(np.trace(spread) * np.eye(3) - spread))
        tensor = _entries(tensor_in(longer, conjugate(turned)))
    tensor = {key: scale.mass * value for key, value in tensor.items()}
    place = list(inertia.com.position)
    place[index] *= scale.length
    x, y, z = (value + off for value, off in zip(place, scale.com, strict=True))
    com = inertia.com._replace(position=(x, y, z))
    return replace(inertia, mass=inertia.mass * scale.mass, com=com, **tensor)


def _entries(tensor: np.ndarray) -> dict[str, Any]:
    return {key: float(tensor[place]) for key, place in _ENTRIES.items()}
