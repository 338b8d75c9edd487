"""What may differ from a robot as it was made, and what becomes of a link's inertia."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any, NamedTuple, Protocol

import numpy as np

from bullet_gazebo.physics.description import Inertia
from bullet_gazebo.physics.dynamics import tensor_in
from bullet_gazebo.physics.pose import IDENTITY, ZERO, Quaternion, Vector, conjugate


class LinkScale(NamedTuple):
    """How a link's figures differ.

    Its length is that along an axis of its own frame: with it grow the way to the centre of mass, and the
    moments. Shapes and joints stay where they are.
    """

    mass: float = 1.0  # factor
    length: float = 1.0  # factor
    com: Vector = ZERO  # [m] by which the centre of mass lies off, in the link's frame
    axis: str = "z"  # of the length


@dataclass(frozen=True)
class Variation:
    """What differs from the robot as it was made.

    Every variation of one robot names the same links, joints and controllers: those that aren't named stay
    as the variation before left them.

    Args:
        links: by the link's name.
        damping: viscous friction [N s/m, N m s/rad] beside the joint's own, by its name.
        friction: dry friction [N, N m] beside the joint's own, by its name.
        surfaces: factors of the friction of a link's surfaces, by its name.
        gains: factors of p, i and d of all PIDs of a controller, by its name; clamps stay.
        gravity: factor of the world's; None: nothing is said of it.
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
    """Says which robot an episode gets."""

    def draw(self, rng: np.random.Generator) -> tuple[Variation, Any]:
        """Draws one; what tells of it in the reset's `info["variation"]` comes with it."""
        ...


_AXES = {  # of a length: its index, and the moments and products that each power of the length goes with
    "x": (0, ("iyy", "izz"), ("ixy", "ixz")),
    "y": (1, ("ixx", "izz"), ("ixy", "iyz")),
    "z": (2, ("ixx", "iyy"), ("ixz", "iyz")),
}
_ENTRIES = {
    "ixx": (0, 0),
    "ixy": (0, 1),
    "ixz": (0, 2),
    "iyy": (1, 1),
    "iyz": (1, 2),
    "izz": (2, 2),
}


def length_axis(inertia: Inertia) -> str:
    """The axis of the link's frame along which it is long: where its centre of mass lies furthest out."""
    x, y, z = (abs(value) for value in inertia.com.position)
    return "z" if z >= max(x, y) else "x" if x >= y else "y"


def scaled(inertia: Inertia, scale: LinkScale) -> Inertia:
    """A link's figures as a variation has them, taken for a rod's.

    With the length the moments about the axes across it grow with its square, about it not at all.
    """
    index, moments, products = _AXES[scale.axis]
    mass, length = scale.mass, scale.length
    powers = dict.fromkeys(moments, mass * length * length) | dict.fromkeys(products, mass * length)
    turned = inertia.com.orientation
    if length == 1.0 or turned == IDENTITY:
        tensor = {key: getattr(inertia, key) * powers.get(key, mass) for key in _ENTRIES}
    else:  # the length is along an axis of the link, the tensor is given in axes of its own
        straight = _turned(inertia, IDENTITY)
        tensor = {key: value * powers.get(key, mass) for key, value in straight.items()}
        tensor = _turned(Inertia(inertia.mass, **tensor), conjugate(turned))
    place = list(inertia.com.position)
    place[index] *= length
    x, y, z = (value + off for value, off in zip(place, scale.com, strict=True))
    com = inertia.com._replace(position=(x, y, z))
    return replace(inertia, mass=inertia.mass * mass, com=com, **tensor)


def _turned(inertia: Inertia, orientation: Quaternion) -> dict[str, float]:
    tensor = tensor_in(inertia, orientation)
    return {key: float(tensor[place]) for key, place in _ENTRIES.items()}
