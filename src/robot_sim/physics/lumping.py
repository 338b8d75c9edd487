"""The tree of links and joints, and its fixed joints, lumped as sdformat does for a URDF.

See docs/contract/gazebo.md 2.4. The child of a fixed joint becomes part of its parent: its inertia, shapes
and the joints below it move up, and its name disappears. A root link called `world` is the world itself.
Links without mass are dropped.
"""

from collections import defaultdict
from collections.abc import Iterable
from dataclasses import replace
from typing import TypeVar

from robot_sim.physics.description import DescriptionError, Inertia, Joint, Link, ModelDescription, Shape
from robot_sim.physics.dynamics import combine, is_positive_definite
from robot_sim.physics.pose import Pose

MAX_LINKS = 1000  # in the file; robots have some hundreds, and lumping takes quadratic time

Named = TypeVar("Named", Link, Joint)


WORLD = "world"
LUMPED = "_fixed_joint_lump__"


def unique(items: Iterable[Named], what: str) -> dict[str, Named]:
    """Returns `items` by name."""
    named: dict[str, Named] = {}
    for item in items:
        if item.name in named:
            raise DescriptionError(f"{what} '{item.name}' is there twice")
        named[item.name] = item
    return named


def find_roots(links: dict[str, Link], joints: dict[str, Joint]) -> list[str]:
    """Returns the links without a parent joint, in document order; all others hang from one of them."""
    check_links(links, joints)
    below: dict[str, list[str]] = defaultdict(list)
    children: set[str] = set()
    for joint in joints.values():
        if joint.child in children:
            raise DescriptionError(f"link '{joint.child}' has more than one parent joint")
        children.add(joint.child)
        below[joint.parent].append(joint.child)
    roots = [name for name in links if name not in children]
    if not roots:
        raise DescriptionError("the links form a loop: no link is without a parent joint")
    reached, todo = set(roots), list(roots)
    while todo:
        names = below[todo.pop()]
        reached.update(names)
        todo.extend(names)
    loop = [name for name in links if name not in reached]
    if loop:
        raise DescriptionError(f"links {loop[:10]} form a loop")
    return roots


def check_links(links: dict[str, Link], joints: dict[str, Joint]) -> None:
    """Refuses a model without links, with too many, or with joints to links that it doesn't have."""
    if not links:
        raise DescriptionError("there is no <link>")
    if len(links) > MAX_LINKS:
        raise DescriptionError(f"there are {len(links)} links; up to {MAX_LINKS} are read (MAX_LINKS)")
    for joint in joints.values():
        for role, name in (("parent", joint.parent), ("child", joint.child)):
            if name not in links:
                raise DescriptionError(f"joint '{joint.name}': {role} link '{name}' does not exist")


def lump_fixed_joints(model: ModelDescription) -> ModelDescription:
    """Lumps fixed joints and drops massless links, in place; returns `model`.

    Links and joints are in sdformat's order afterwards: depth first, children by the names of their joints.
    """
    model.joints = dict(sorted(model.joints.items()))
    detach_from_world(model)
    model.foot = 0
    order = _depth_first(model)
    above = {joint.child: joint for joint in model.joints.values()}
    for child in reversed(_depth_first(model, backwards=True)):
        if child in above and above[child].kind == "fixed" and not above[child].kept:
            _lump(model, above[child].name)
    _drop_free_joints(model)
    drop_massless(model)
    model.links = {name: model.links[name] for name in order if name in model.links}
    left = (above[name].name for name in order if name in above)
    model.joints = {name: model.joints[name] for name in left if name in model.joints}
    model.lumped = {name: at for name, at in model.lumped.items() if at[0] in model.links}
    model.sensors.sort(key=lambda sensor: order.index(sensor.link))
    places = [model.lumped.get(each.link, (each.link, Pose())) for each in model.sensors]
    model.sensors = [
        replace(sensor, link=link, pose=pose.compose(sensor.pose))
        for sensor, (link, pose) in zip(model.sensors, places, strict=True)
        if link in model.links
    ]
    mend_moments(model)
    for link in model.links.values():
        link.collisions = _named(link, link.collisions, "_collision")
        link.visuals = _named(link, link.visuals, "_visual")
    return model


def _depth_first(model: ModelDescription, backwards: bool = False) -> list[str]:
    """Returns the links below the root, each before its children; with `backwards` the last child first."""
    below = model.joints_by_parent()
    order, todo = [], [model.root]
    while todo:
        order.append(todo.pop())
        joints = below[order[-1]]
        todo += [joint.child for joint in (joints if backwards else reversed(joints))]
    return order


def _named(link: Link, shapes: list[Shape], suffix: str) -> list[Shape]:
    """Names shapes as sdformat does: after the link, numbered from the second one on.

    A name of their own, or the lumped link's that they come from, is added, unless it begins as the link's.
    """
    names = []
    for count, shape in enumerate(shapes):
        own = shape.name or link.name
        stem = own if own.startswith(link.name) else link.name + LUMPED + own
        names.append(f"{stem}{suffix}_{count}" if count else f"{stem}{suffix}")
    return [replace(shape, name=name) for shape, name in zip(shapes, names, strict=True)]


def detach_from_world(model: ModelDescription) -> None:
    """Fixes the base of a model whose root is the link `world`; with a single fixed joint, drops `world`."""
    if model.root != WORLD:
        return
    anchors = [joint for joint in model.joints.values() if joint.parent == WORLD]
    model.world_joints = [joint.name for joint in anchors if joint.kind == "fixed"]
    if len(anchors) == 1 and anchors[0].kind == "fixed":
        model.foot = list(model.joints).index(anchors[0].name)
        del model.joints[anchors[0].name], model.links[WORLD]
        model.root, model.root_pose = anchors[0].child, anchors[0].pose
        return
    for joint in anchors:
        joint.kept = joint.kept or joint.kind == "fixed"
    if not model.world_joints:
        model.world_joints = [WORLD]


def _lump(model: ModelDescription, name: str) -> None:
    joint = model.joints.pop(name)
    parent, child = model.links[joint.parent], model.links.pop(joint.child)
    if child.says_gravity:
        parent.gravity, parent.says_gravity = child.gravity, True
    parent.self_collide = parent.self_collide or child.self_collide
    parent.kinematic = parent.kinematic or child.kinematic
    parent.decay = child.decay if parent.decay is None else parent.decay
    own = child.inertia
    moved = None if own is None else replace(own, com=joint.pose.compose(own.com))
    parent.inertia = combine(parent.inertia, moved)
    parent.collisions += [_lumped(shape, joint.pose, child.name) for shape in child.collisions]
    parent.visuals += [_lumped(shape, joint.pose, child.name) for shape in child.visuals]
    for other in model.joints.values():
        if other.parent == child.name:
            other.parent, other.pose = parent.name, joint.pose.compose(other.pose)
    for name, (link, pose) in model.lumped.items():
        if link == child.name:
            model.lumped[name] = parent.name, joint.pose.compose(pose)
    model.lumped[child.name] = parent.name, joint.pose


def _lumped(shape: Shape, pose: Pose, link: str) -> Shape:
    return replace(shape, pose=pose.compose(shape.pose), name=shape.name or link)


def _drop_free_joints(model: ModelDescription) -> None:
    """Drops a floating or planar joint to the world, as Gazebo does: the robot has a free base."""
    for joint in [j for j in model.joints.values() if not j.movable and not j.kept]:
        if (
            not joint.parent == model.root == WORLD
            or len([j for j in model.joints.values() if j.parent == WORLD]) > 1
        ):
            raise DescriptionError(
                f"joint '{joint.name}': a {joint.kind} joint is only simulated as the free base of a robot"
            )
        del model.joints[joint.name], model.links[WORLD]
        model.root, model.root_pose, model.world_joints = joint.child, joint.pose, []


def mend_moments(model: ModelDescription) -> None:
    """Replaces moments of inertia that no body has (mostly zeros) by 1 kg m², as ODE does.

    With those of the file the first step would give NaN.
    """
    for link in model.links.values():
        inertia = link.inertia
        if model.static or inertia is None or inertia.mass <= 0.0 or is_positive_definite(inertia):
            continue
        model.warnings.append(
            f"link '{link.name}': no body has its moments of inertia; they are 1 kg m² instead, as in ODE"
        )
        link.inertia = Inertia(inertia.mass, inertia.com, ixx=1.0, iyy=1.0, izz=1.0)


def drop_massless(model: ModelDescription) -> None:
    for name in list(model.links):
        link = model.links.get(name)
        if link is None or name == WORLD or (link.inertia is not None and link.inertia.mass > 0.0):
            continue
        if name == model.root and not model.static:
            raise DescriptionError(f"link '{name}': the root link has no mass, so Gazebo drops the model")
        if name != model.root:
            _drop_subtree(model, link)


def _drop_subtree(model: ModelDescription, link: Link) -> None:
    model.warnings.append(f"link '{link.name}' has no mass: it is dropped with all that hangs from it")
    doomed = [link.name]
    while doomed:
        name = doomed.pop()
        model.links.pop(name, None)
        for joint in [j for j in model.joints.values() if name in (j.parent, j.child)]:
            if joint.parent == name:
                doomed.append(joint.child)
            del model.joints[joint.name]
