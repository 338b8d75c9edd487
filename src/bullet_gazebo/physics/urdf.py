"""Reads URDF text (wiki.ros.org/urdf/XML) into a ModelDescription."""

import math
from collections.abc import Iterable
from typing import TypeVar
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

from bullet_gazebo.physics.description import (
    DescriptionError,
    Inertia,
    Joint,
    Link,
    ModelDescription,
    Plugin,
    Shape,
)
from bullet_gazebo.physics.lumping import lump_fixed_joints
from bullet_gazebo.physics.pose import Pose, from_rpy

KINDS = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar")
WORLD = "world"

Named = TypeVar("Named", Link, Joint)


def parse_urdf(text: str, source: str = "URDF") -> ModelDescription:
    """Returns the model that `text` describes, its fixed joints lumped as Gazebo does.

    Errors: DescriptionError with `source`, the place and the fault, in one line.
    """
    try:
        robot = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise DescriptionError(f"{source}: not well-formed XML: {error}") from error
    if robot.tag != "robot":
        raise DescriptionError(f"{source}: the root element is <{robot.tag}>, not <robot>")
    try:
        return lump_fixed_joints(_model(robot))
    except DescriptionError as error:
        raise DescriptionError(f"{source}: {error}") from error


def _model(robot: Element) -> ModelDescription:
    materials = {m.get("name", ""): _rgba(m) for m in robot.findall("material")}
    links = _unique((_link(e, materials) for e in robot.findall("link")), "link")
    joints = _unique((_joint(e) for e in robot.findall("joint")), "joint")
    return ModelDescription(
        name=robot.get("name", ""),
        links=links,
        joints=joints,
        root=_root(links, joints),
        plugins=_plugins(robot),
        self_collide=_flag(robot, "self_collide"),
        static=_flag(robot, "static"),
    )


def _unique(items: Iterable[Named], what: str) -> dict[str, Named]:
    found: dict[str, Named] = {}
    for item in items:
        if item.name in found:
            raise DescriptionError(f"{what} '{item.name}' is there twice")
        found[item.name] = item
    return found


def _root(links: dict[str, Link], joints: dict[str, Joint]) -> str:
    """The one link that is nobody's child; every other link hangs from it by exactly one joint."""
    if not links:
        raise DescriptionError("there is no <link>")
    children: set[str] = set()
    for joint in joints.values():
        for role, name in (("parent", joint.parent), ("child", joint.child)):
            if name not in links:
                raise DescriptionError(f"joint '{joint.name}': {role} link '{name}' does not exist")
        if joint.child in children:
            raise DescriptionError(f"link '{joint.child}' has more than one parent joint")
        children.add(joint.child)
    roots = [name for name in links if name not in children]
    if not roots:
        raise DescriptionError("the links form a loop: no link is without a parent joint")
    if len(roots) > 1:
        raise DescriptionError(f"links {roots} all have no parent joint; one root is needed")
    _check_connected(roots[0], links, joints)
    return roots[0]


def _check_connected(root: str, links: dict[str, Link], joints: dict[str, Joint]) -> None:
    reached, todo = {root}, [root]
    while todo:
        parent = todo.pop()
        below = [joint.child for joint in joints.values() if joint.parent == parent]
        reached.update(below)
        todo.extend(below)
    loop = [name for name in links if name not in reached]
    if loop:
        raise DescriptionError(f"links {loop} form a loop")


def _link(element: Element, materials: dict) -> Link:
    name = _name(element, "link")
    place = f"link '{name}'"
    inertial = element.find("inertial")
    return Link(
        name=name,
        inertia=None if inertial is None else _inertia(inertial, place),
        collisions=[_shape(e, place, {}) for e in element.findall("collision")],
        visuals=[_shape(e, place, materials) for e in element.findall("visual")],
    )


def _inertia(inertial: Element, place: str) -> Inertia:
    place = f"{place}, inertial"
    mass, tensor = inertial.find("mass"), inertial.find("inertia")
    if mass is None:
        raise DescriptionError(f"{place}: <mass> is missing")
    if tensor is None:
        raise DescriptionError(f"{place}: <inertia> is missing")
    values = {
        key: _number(tensor, key, place) for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    }
    value = _number(mass, "value", place, required=True)
    if value < 0.0 or min(values["ixx"], values["iyy"], values["izz"]) < 0.0:
        raise DescriptionError(f"{place}: mass and moments of inertia can't be negative")
    return Inertia(mass=value, com=_origin(inertial, place), **values)


def _shape(element: Element, place: str, materials: dict) -> Shape:
    place = f"{place}, {element.tag}"
    geometry = element.find("geometry")
    if geometry is None or len(geometry) == 0:
        raise DescriptionError(f"{place}: <geometry> with a shape is missing")
    solid, pose, mesh = geometry[0], _origin(element, place), ""
    if solid.tag == "box":
        size = _numbers(solid, "size", place, 3)
    elif solid.tag == "cylinder":
        size = tuple(_number(solid, key, place, required=True) for key in ("radius", "length"))
    elif solid.tag == "sphere":
        size = (_number(solid, "radius", place, required=True),)
    elif solid.tag == "mesh":
        mesh = solid.get("filename", "")
        size = _numbers(solid, "scale", place, 3) if solid.get("scale") else (1.0, 1.0, 1.0)
    else:
        raise DescriptionError(f"{place}: geometry <{solid.tag}> is not known")
    material = element.find("material")
    rgba = None
    if material is not None:
        rgba = _rgba(material) or materials.get(material.get("name", ""))
    return Shape(solid.tag, size, pose, mesh, rgba, element.get("name", ""))


def _joint(element: Element) -> Joint:
    name = _name(element, "joint")
    place = f"joint '{name}'"
    kind = element.get("type", "")
    if kind not in KINDS:
        raise DescriptionError(f"{place}: type '{kind}' is none of {', '.join(KINDS)}")
    joint = Joint(
        name=name,
        kind=kind,
        parent=_referred_link(element, "parent", place),
        child=_referred_link(element, "child", place),
        pose=_origin(element, place),
    )
    _set_axis(joint, element, place)
    _set_limit(joint, element, place)
    _set_dynamics(joint, element, place)
    return joint


def _set_axis(joint: Joint, element: Element, place: str) -> None:
    axis = element.find("axis")
    if axis is None or not joint.movable:
        return
    x, y, z = _numbers(axis, "xyz", place, 3)
    length = math.sqrt(x * x + y * y + z * z)
    if length == 0.0:
        raise DescriptionError(f"{place}: the axis has length 0")
    joint.axis = (x / length, y / length, z / length)


def _set_limit(joint: Joint, element: Element, place: str) -> None:
    limit = element.find("limit")
    if limit is None:
        if joint.bounded:
            raise DescriptionError(f"{place}: a {joint.kind} joint needs <limit>")
        return
    place = f"{place}, limit"
    joint.effort = _number(limit, "effort", place, required=True)
    joint.velocity = _number(limit, "velocity", place, required=True)
    if joint.bounded:  # a continuous joint ignores lower and upper
        joint.lower = _number(limit, "lower", place)
        joint.upper = _number(limit, "upper", place)
        if joint.lower > joint.upper:
            raise DescriptionError(f"{place}: lower {joint.lower} is above upper {joint.upper}")


def _set_dynamics(joint: Joint, element: Element, place: str) -> None:
    dynamics = element.find("dynamics")
    if dynamics is not None:
        joint.damping = _number(dynamics, "damping", place)
        joint.friction = _number(dynamics, "friction", place)


def _plugins(robot: Element) -> list[Plugin]:
    """Plugins of the model: children of `<gazebo>` blocks that refer to no link or joint."""
    blocks = [block for block in robot.findall("gazebo") if block.get("reference") is None]
    return [
        Plugin(element.get("filename", ""), element.get("name", ""), element)
        for block in blocks
        for element in block.findall("plugin")
    ]


def _flag(robot: Element, tag: str) -> bool:
    values = [
        e.text
        for block in robot.findall("gazebo")
        if block.get("reference") is None
        for e in block.findall(tag)
    ]
    return any((value or "").strip().lower() in ("true", "1") for value in values)


def _origin(element: Element, place: str) -> Pose:
    origin = element.find("origin")
    if origin is None:
        return Pose()
    position = _numbers(origin, "xyz", place, 3) if origin.get("xyz") else (0.0, 0.0, 0.0)
    rpy = _numbers(origin, "rpy", place, 3) if origin.get("rpy") else (0.0, 0.0, 0.0)
    return Pose((position[0], position[1], position[2]), from_rpy(*rpy))


def _rgba(material: Element) -> tuple[float, float, float, float] | None:
    color = material.find("color")
    if color is None:
        return None
    r, g, b, a = _numbers(color, "rgba", f"material '{material.get('name', '')}'", 4)
    return (r, g, b, a)


def _name(element: Element, what: str) -> str:
    name = element.get("name", "")
    if not name:
        raise DescriptionError(f"a <{what}> has no name")
    return name


def _referred_link(element: Element, role: str, place: str) -> str:
    child = element.find(role)
    if child is None or not child.get("link"):
        raise DescriptionError(f"{place}: <{role} link=…> is missing")
    return child.get("link", "")


def _number(element: Element, key: str, place: str, required: bool = False) -> float:
    text = element.get(key)
    if text is None:
        if required:
            raise DescriptionError(f"{place}: <{element.tag}> needs the attribute '{key}'")
        return 0.0
    return _finite(text, f"{place}: <{element.tag} {key}>")


def _numbers(element: Element, key: str, place: str, count: int) -> tuple[float, ...]:
    text = element.get(key)
    words = (text or "").split()
    if len(words) != count:
        raise DescriptionError(f"{place}: <{element.tag} {key}='{text}'> must hold {count} numbers")
    return tuple(_finite(word, f"{place}: <{element.tag} {key}>") for word in words)


def _finite(text: str, place: str) -> float:
    try:
        value = float(text)
    except ValueError as error:
        raise DescriptionError(f"{place}: '{text}' is not a number") from error
    if not math.isfinite(value):
        raise DescriptionError(f"{place}: '{text}' is not finite")
    return value
