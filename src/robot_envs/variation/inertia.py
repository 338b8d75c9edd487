"""What becomes of a link's mass, centre of mass and tensor where they are scaled."""

from dataclasses import replace

from bullet_gazebo.physics.description import Inertia
from bullet_gazebo.physics.dynamics import tensor_in
from bullet_gazebo.physics.pose import IDENTITY, Quaternion, conjugate
from robot_envs.variation.variation import LinkScale

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
