"""The form that the engine takes a model in: each link's frame is that of the joint that carries it."""

from collections import defaultdict
from dataclasses import replace

from bullet_gazebo.physics.description import Joint, Link, ModelDescription, Shape
from bullet_gazebo.physics.mechanics.bounds import MOST_JOINTS, check_bounds
from bullet_gazebo.physics.pose import Pose


def at_joints(model: ModelDescription) -> tuple[ModelDescription, dict[str, Pose]]:
    """Returns the model with link frames moved onto their joints, and where the links' own frames are.

    The second result, by link name, holds the frames that were moved, as seen from the new ones; it is
    empty for a model that has that form already, as every URDF has.

    Raises:
        DescriptionError: if the engine can't compute with it.
    """
    if model.static:
        model = _rigid(model)
    check_bounds(model)
    offsets = {
        joint.child: joint.anchor.inverse()
        for joint in model.joints.values()
        if joint.anchor != Pose()
    }
    model = one_friction_each(model)
    if not offsets:
        return model, offsets
    links = {name: _moved(link, offsets.get(name)) for name, link in model.links.items()}
    joints = {name: _joined(joint, offsets) for name, joint in model.joints.items()}
    return replace(model, links=links, joints=joints), offsets


def one_friction_each(model: ModelDescription) -> ModelDescription:
    """Returns the model with each link's collisions alike in friction: the engine has one figure for a
    link. Other ones, a caster's under a base, go to massless links that are fixed to it.

    Beyond what the engine takes, a link keeps its first collision's.
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
    """One link for each friction of `link` but the first."""
    groups: dict[float, list[Shape]] = defaultdict(list)
    for shape in link.collisions:
        groups[shape.mu].append(shape)
    return [
        Link(
            f"{link.name}::friction_{count}",
            collisions=shapes,
            self_collide=link.self_collide,
            part_of=link.name,
        )
        for count, shapes in enumerate(list(groups.values())[1:], 1)
    ]


def parents_first(model: ModelDescription) -> ModelDescription:
    """Returns the model with each link after the one that carries it: the engine crashes otherwise."""
    below = defaultdict(list)
    for joint in model.joints.values():
        below[joint.parent].append(joint.child)
    order = [model.root]
    for name in order:
        order.extend(below[name])  # the list grows while it is walked
    return replace(model, links={name: model.links[name] for name in order})


def _rigid(model: ModelDescription) -> ModelDescription:
    """A static model: all its joints fixed, and its islands fixed to the root."""
    joints = {
        name: replace(joint, kind="fixed", anchor=Pose()) for name, joint in model.joints.items()
    }
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


def _joined(joint: Joint, offsets: dict[str, Pose]) -> Joint:
    parent = offsets.get(joint.parent, Pose())
    return replace(joint, pose=parent.compose(joint.pose).compose(joint.anchor), anchor=Pose())
