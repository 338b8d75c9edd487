"""Domain randomisation: the robot with other masses, lengths and friction, the same for every plant."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

MOST_CHANGE = 0.9  # of a mass or length, either way
MOST_CART_FRICTION = 20.0  # [N s/m]; far more would be stiffer than a physics step can follow
MOST_POLE_FRICTION = 0.5  # [N m s/rad]


class Variation(NamedTuple):
    """One robot: factors of the nominal one's figures, and viscous friction of its joints."""

    cart_mass: float = 1.0
    pole_mass: float = 1.0
    pole_length: float = 1.0
    cart_friction: float = 0.0  # [N s/m]
    pole_friction: float = 0.0  # [N m s/rad]


NOMINAL = Variation()


@dataclass(frozen=True)
class Randomisation:
    """From what a `Variation` is drawn for each episode, uniformly.

    Args:
        mass: half-width of the factor on each mass, e.g. 0.2 for 0.8 to 1.2.
        length: half-width of the factor on the pole's length.
        cart_friction: most viscous friction between cart and rail [N s/m].
        pole_friction: most viscous friction in the hinge [N m s/rad].

    Raises:
        ValueError: if one of them is negative or too large.
    """

    mass: float = 0.0
    length: float = 0.0
    cart_friction: float = 0.0
    pole_friction: float = 0.0

    def __post_init__(self) -> None:
        for name, most in (
            ("mass", MOST_CHANGE),
            ("length", MOST_CHANGE),
            ("cart_friction", MOST_CART_FRICTION),
            ("pole_friction", MOST_POLE_FRICTION),
        ):
            value = getattr(self, name)
            if not 0.0 <= value <= most:
                raise ValueError(f"randomisation of {name} must lie in [0, {most}], not {value}")

    def draw(self, rng: np.random.Generator) -> Variation:
        """Draws one robot; always five numbers, so that streams don't depend on what is varied."""
        cart, pole, length, rail, hinge = (float(value) for value in rng.random(5))
        return Variation(
            1.0 + self.mass * (2.0 * cart - 1.0),
            1.0 + self.mass * (2.0 * pole - 1.0),
            1.0 + self.length * (2.0 * length - 1.0),
            self.cart_friction * rail,
            self.pole_friction * hinge,
        )


class Figures(NamedTuple):
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


def varied_cart(nominal: Figures, variation: Variation) -> Figures:
    """The cart of another mass: its shape and how the mass is spread stay."""
    return _scaled(nominal, variation.cart_mass, 1.0)


def varied_pole(nominal: Figures, variation: Variation) -> Figures:
    """The pole of another mass and length; it stands along z of its link, from the hinge on."""
    return _scaled(nominal, variation.pole_mass, variation.pole_length)


def _scaled(nominal: Figures, mass: float, length: float) -> Figures:
    """With z times `length`: so the moments about x and y grow with its square, about z not at all."""
    x, y, z = nominal.com
    across = mass * length * length
    return Figures(
        nominal.mass * mass,
        (x, y, z * length),
        nominal.ixx * across,
        nominal.ixy * mass,
        nominal.ixz * mass * length,
        nominal.iyy * across,
        nominal.iyz * mass * length,
        nominal.izz * mass,
    )
