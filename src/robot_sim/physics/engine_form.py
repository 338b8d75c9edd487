"""The form of a model that engines take: bounds checked, link frames on joints, one friction a link.

A value out of bounds raises DescriptionError, which names the place.
"""

from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from robot_sim.physics.description import DescriptionError, Joint, Link, ModelDescription, Shape
from robot_sim.physics.pose import Pose

MOST_JOINTS = 127  # of one body in PyBullet, fixed ones included
MOST_COORDINATES = 128  # a free base has 7
FREE_BASE = 7
MOST_SHAPES = 5000  # beyond that, PyBullet takes seconds to load a model
FURTHEST = 1e7  # [m]; no length in a model may be larger
MASSES = (1e-9, 1e9)  # [kg]
LARGEST_MOMENT = 1e15  # [kg m²]
STRONGEST = 1e12  # damping [N m s/rad, N s/m], friction [N m, N], stiffness [N m/rad, N/m]


def check_bounds(model: ModelDescription) -> None:
    """Refuses a model that would crash or hang an engine, or make it lose the world."""
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
    """Refuses links with too many shapes, before lumping, which would take long, and after it."""
    shapes = sum(len(link.collisions) + len(link.visuals) for link in links)
    if shapes > MOST_SHAPES:
        raise DescriptionError(f"it has {shapes} collisions and visuals; up to {MOST_SHAPES} are taken")


def _check_link(link: Link, static: bool) -> None:
    for length in _lengths(link):
        if not abs(length) <= FURTHEST:
            raise DescriptionError(f"link '{link.name}': {length} m is beyond {FURTHEST:g} m")
    for shape in link.collisions:
        if shape.solid is None:
            continue
        reach = float((shape.solid.reach * np.abs(shape.size)).max())
        if not reach <= FURTHEST:
            raise DescriptionError(
                f"link '{link.name}': mesh '{shape.mesh}' reaches to {reach:g} m, beyond {FURTHEST:g} m"
            )
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
    if not abs(joint.spring_reference) <= FURTHEST:
        raise DescriptionError(
            f"joint '{joint.name}': a spring_reference of {joint.spring_reference} is beyond {FURTHEST:g}"
        )
    for what in ("damping", "friction", "spring_stiffness"):
        value = getattr(joint, what)
        if not 0.0 <= value <= STRONGEST:
            raise DescriptionError(
                f"joint '{joint.name}': a {what} of {value} is not between 0 and {STRONGEST:g}"
            )


def at_joints(model: ModelDescription) -> tuple[ModelDescription, dict[str, Pose]]:
    """Returns the model with link frames moved onto their joints; every URDF has that form already.

    And by link name the original frames as seen from the new ones, where they differ.
    """
    if model.static:
        model = rigid(model)
    check_bounds(model)
    offsets = {
        joint.child: joint.anchor.inverse() for joint in model.joints.values() if joint.anchor != Pose()
    }
    if model.loops:  # helpers that close them have shares of links' inertias
        inertias = model.inertias()
        links = {name: replace(each, inertia=inertias[name]) for name, each in model.links.items()}
        model = replace(model, links=links)
    root = model.links[model.root]
    if root.kinematic:
        heavy = replace(root, inertia=root.acting_inertia)
        model = replace(model, links={**model.links, root.name: heavy})
    model = one_friction_each(model)
    if not offsets:
        return model, offsets
    links = {name: _moved(link, offsets.get(name)) for name, link in model.links.items()}
    joints = {}
    for name, joint in model.joints.items():
        pose = offsets.get(joint.parent, Pose()).compose(joint.pose).compose(joint.anchor)
        joints[name] = replace(joint, pose=pose, anchor=Pose())
    return replace(model, links=links, joints=joints), offsets


def one_friction_each(model: ModelDescription) -> ModelDescription:
    """Returns the model with one friction for each link, as PyBullet has it.

    Collisions with another friction, such as a caster's under a base, move to massless links that are fixed
    to theirs. Where there would be too many links, the first collision's friction counts.
    """
    pieces = [piece for link in model.links.values() for piece in _pieces(link)]
    if len(model.joints) + len(pieces) > MOST_JOINTS:
        return model
    links, joints = dict(model.links), dict(model.joints)
    for piece in pieces:
        whole = links[piece.part_of]
        kept = [shape for shape in whole.collisions if shape not in piece.collisions]
        links[piece.part_of] = replace(whole, collisions=kept)
        links[piece.name] = piece
        joints[piece.name] = Joint(piece.name, "fixed", piece.part_of, piece.name)
    return replace(model, links=links, joints=joints)


def _pieces(link: Link) -> list[Link]:
    """Returns a link for each friction of `link` but the first."""
    groups: dict[float, list[Shape]] = defaultdict(list)
    for shape in link.collisions:
        groups[shape.mu].append(shape)
    return [
        Link(
            f"{link.name}::friction_{count}",
            collisions=shapes,
            self_collide=link.self_collide,
            kinematic=link.kinematic,
            part_of=link.name,
        )
        for count, shapes in enumerate(list(groups.values())[1:], 1)
    ]


def parents_first(model: ModelDescription) -> ModelDescription:
    """Returns the model with each link after its parent: PyBullet crashes otherwise."""
    order = [model.root, *(joint.child for joint in model.joints_below(model.root))]
    return replace(model, links={name: model.links[name] for name in order})


def rigid(model: ModelDescription) -> ModelDescription:
    """Returns a static model with all joints fixed, and its islands fixed to the root."""
    joints = {name: replace(joint, kind="fixed", anchor=Pose()) for name, joint in model.joints.items()}
    for link, pose in model.islands.items():
        name = f"{link}::island"
        joints[name] = Joint(name, "fixed", model.root, link, pose)
    return replace(model, joints=joints)


def _moved(link: Link, offset: Pose | None) -> Link:
    if offset is None:
        return link
    inertia = link.inertia
    return replace(
        link,
        inertia=None if inertia is None else replace(inertia, com=offset.compose(inertia.com)),
        collisions=[replace(s, pose=offset.compose(s.pose)) for s in link.collisions],
        visuals=[replace(s, pose=offset.compose(s.pose)) for s in link.visuals],
    )
