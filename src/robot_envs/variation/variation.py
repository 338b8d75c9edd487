"""Domain randomisation: what differs from the robot as it was made, the same for every backend."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol

import numpy as np

from bullet_gazebo.physics.pose import ZERO, Vector


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

    @property
    def undone(self) -> "Variation":
        """What takes it back."""
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
