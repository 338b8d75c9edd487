"""The form that the engine takes a model in: each link's frame is that of the joint that carries it."""

from collections import defaultdict
from dataclasses import replace

from bullet_gazebo.physics.bounds import check_bounds
from bullet_gazebo.physics.description import Joint, Link, ModelDescription
from bullet_gazebo.physics.pose import Pose


def at_joints(model: ModelDescription) -> tuple[ModelDescription, dict[str, Pose]]:
    """Returns the model with link frames moved onto their joints, and where the links' own frames are.

    The second result, by link name, holds the frames that were moved, as seen from the new ones; it is
    empty for a model that has that form already, as every URDF has.

    Errors: DescriptionError if the engine can't compute with it.
    """
    if model.static:
        model = _rigid(model)
    check_bounds(model)
    offsets = {
        joint.child: joint.anchor.inverse()
        for joint in model.joints.values()
        if joint.anchor != Pose()
    }
    if not offsets:
        return model, offsets
    links = {name: _moved(link, offsets.get(name)) for name, link in model.links.items()}
    joints = {name: _joined(joint, offsets) for name, joint in model.joints.items()}
    return replace(model, links=links, joints=joints), offsets


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
