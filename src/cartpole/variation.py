"""Domain randomisation of the cart-pole: its masses, the pole's length, and friction of both joints."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from cartpole.robot import CART_JOINT, CART_LINK, POLE_JOINT, POLE_LINK
from robot_envs.variation import LinkScale, Variation

MOST_CHANGE = 0.9  # of a mass or length, either way
MOST_CART_FRICTION = 20.0  # [N s/m]; far more would be stiffer than a physics step can follow
MOST_POLE_FRICTION = 0.5  # [N m s/rad]


class CartPoleVariation(NamedTuple):
    """One robot: factors of the nominal one's figures, and viscous friction of its joints."""

    cart_mass: float = 1.0
    pole_mass: float = 1.0
    pole_length: float = 1.0  # it stands along z of its link, from the hinge on
    cart_friction: float = 0.0  # [N s/m]
    pole_friction: float = 0.0  # [N m s/rad]

    def of_robot(self) -> Variation:
        """The same by the names of links and joints."""
        return Variation(
            {
                CART_LINK: LinkScale(self.cart_mass),
                POLE_LINK: LinkScale(self.pole_mass, self.pole_length),
            },
            damping={CART_JOINT: self.cart_friction, POLE_JOINT: self.pole_friction},
        )


@dataclass(frozen=True)
class Randomisation:
    """From what a `CartPoleVariation` is drawn for each episode, uniformly.

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

    def draw(self, rng: np.random.Generator) -> tuple[Variation, np.ndarray]:
        """Draws one robot; the array, (5,), is its `CartPoleVariation`.

        Always five numbers, so that streams don't depend on what is varied.
        """
        cart, pole, length, rail, hinge = (float(value) for value in rng.random(5))
        drawn = CartPoleVariation(
            1.0 + self.mass * (2.0 * cart - 1.0),
            1.0 + self.mass * (2.0 * pole - 1.0),
            1.0 + self.length * (2.0 * length - 1.0),
            self.cart_friction * rail,
            self.pole_friction * hinge,
        )
        return drawn.of_robot(), np.array(drawn)
