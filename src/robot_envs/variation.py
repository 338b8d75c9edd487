"""Domain randomisation: a robot with other masses, lengths and friction, the same for every backend."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

import numpy as np


class LinkScale(NamedTuple):
    """Factors of a link's mass, and of its length along z of its own frame."""

    mass: float = 1.0
    length: float = 1.0


@dataclass(frozen=True)
class Variation:
    """What differs from the robot as it was made.

    Every variation of one robot names the same links and joints: those that aren't named stay as
    the variation before left them.

    Args:
        links: factors, by the link's name.
        friction: viscous friction [N s/m, N m s/rad] beside the joint's own, by its name.
    """

    links: Mapping[str, LinkScale] = field(default_factory=dict)
    friction: Mapping[str, float] = field(default_factory=dict)

    @property
    def is_nominal(self) -> bool:
        """Whether nothing differs."""
        nominal = LinkScale()
        return not any(self.friction.values()) and all(
            scale == nominal for scale in self.links.values()
        )

    @property
    def undone(self) -> "Variation":
        """What takes it back."""
        return Variation(dict.fromkeys(self.links, LinkScale()), dict.fromkeys(self.friction, 0.0))


class Randomisation(Protocol):
    """Says which robot an episode gets."""

    def draw(self, rng: np.random.Generator) -> tuple[Variation, np.ndarray]:
        """Draws one; the array, of any shape, tells of it in the reset's `info["variation"]`."""
        ...


class LinkFigures(NamedTuple):
    """Mass [kg] of a link, its centre [m] in the link's frame, and the tensor about it [kg m²]."""

    mass: float
    com: tuple[float, float, float]
    ixx: float
    ixy: float
    ixz: float
    iyy: float
    iyz: float
    izz: float

    @property
    def tensor(self) -> dict[str, float]:
        """The tensor's entries by name."""
        return {key: value for key, value in self._asdict().items() if key.startswith("i")}

    def scaled(self, scale: LinkScale) -> "LinkFigures":
        """With z times the length: the moments about x and y grow with its square, about z not at all."""
        mass, length = scale
        x, y, z = self.com
        across = mass * length * length
        return LinkFigures(
            self.mass * mass,
            (x, y, z * length),
            self.ixx * across,
            self.ixy * mass,
            self.ixz * mass * length,
            self.iyy * across,
            self.iyz * mass * length,
            self.izz * mass,
        )
