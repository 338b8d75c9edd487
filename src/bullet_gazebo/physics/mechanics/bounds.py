"""What the physics engine can compute with: beyond these figures it crashes, hangs or loses the world."""

from collections.abc import Iterable, Iterator

import numpy as np

from bullet_gazebo.physics.description import DescriptionError, Joint, Link, ModelDescription, Shape

MOST_JOINTS = 127  # of one body in PyBullet, fixed ones included
MOST_COORDINATES = 128  # a free base has 7
FREE_BASE = 7
MOST_SHAPES = 5000  # beyond that, PyBullet takes seconds to load a model
FURTHEST = 1e7  # [m], of anything in a model
MASSES = (1e-9, 1e9)  # [kg]
LARGEST_MOMENT = 1e15  # [kg m²]
STRONGEST = 1e12  # damping [N m s/rad, N s/m] and friction [N m, N]


def check_bounds(model: ModelDescription) -> None:
    """Refuses a model that no engine takes.

    Raises:
        DescriptionError: if `model` is beyond what the engine takes; it names the place.
    """
    _check_counts(model)
    for link in model.links.values():
        _check_link(link, model.static)
    for joint in model.joints.values():
        _check_joint(joint)


def _check_counts(model: ModelDescription) -> None:
    coordinates = len(model.movable_joints) + (0 if model.fixed_base else FREE_BASE)
    if len(model.joints) > MOST_JOINTS or coordinates > MOST_COORDINATES:
        raise DescriptionError(
            f"it has {len(model.joints)} joints: the physics engine takes {MOST_JOINTS} of a model, "
            f"or {MOST_COORDINATES - FREE_BASE} movable ones if it isn't fixed to the world"
        )
    check_shapes(model.links.values())


def check_shapes(links: Iterable[Link]) -> None:
    """Refuses links with too many shapes; before they are lumped, which would take long, and after it.

    Raises:
        DescriptionError: if there are more than MOST_SHAPES.
    """
    shapes = sum(len(link.collisions) + len(link.visuals) for link in links)
    if shapes > MOST_SHAPES:
        raise DescriptionError(
            f"it has {shapes} collisions and visuals; up to {MOST_SHAPES} are taken"
        )


def _check_link(link: Link, static: bool) -> None:
    for length in _lengths(link):
        if not abs(length) <= FURTHEST:
            raise DescriptionError(f"link '{link.name}': {length} m is beyond {FURTHEST:g} m")
    for shape in link.collisions:
        _check_mesh(link, shape)
    inertia = link.inertia
    if inertia is None or static:
        return
    if not MASSES[0] <= inertia.mass <= MASSES[1]:
        raise DescriptionError(
            f"link '{link.name}': a mass of {inertia.mass} kg is not between {MASSES[0]:g} and "
            f"{MASSES[1]:g} kg"
        )
    moments = (inertia.ixx, inertia.ixy, inertia.ixz, inertia.iyy, inertia.iyz, inertia.izz)
    largest = max(abs(moment) for moment in moments)
    if not largest <= LARGEST_MOMENT:
        raise DescriptionError(
            f"link '{link.name}': a moment of inertia of {largest} kg m² is beyond {LARGEST_MOMENT:g}"
        )


def _check_mesh(link: Link, shape: Shape) -> None:
    if shape.solid is None:
        return
    reach = float((np.abs(shape.solid.vertices).max(axis=0) * np.abs(shape.size)).max())
    if not reach <= FURTHEST:
        raise DescriptionError(
            f"link '{link.name}': mesh '{shape.mesh}' reaches to {reach:g} m, beyond {FURTHEST:g} m"
        )


def _lengths(link: Link) -> Iterator[float]:
    if link.inertia is not None:
        yield from link.inertia.com.position
    for shape in (*link.collisions, *link.visuals):
        yield from shape.size
        yield from shape.pose.position


def _check_joint(joint: Joint) -> None:
    for length in (*joint.pose.position, *joint.anchor.position):
        if not abs(length) <= FURTHEST:
            raise DescriptionError(f"joint '{joint.name}': {length} m is beyond {FURTHEST:g} m")
    for what, value in (("damping", joint.damping), ("friction", joint.friction)):
        if not 0.0 <= value <= STRONGEST:
            raise DescriptionError(
                f"joint '{joint.name}': a {what} of {value} is not between 0 and {STRONGEST:g}"
            )
