"""Reads URDF text (wiki.ros.org/urdf/XML) into a ModelDescription."""

import math
from pathlib import Path
from xml.etree.ElementTree import Element

from bullet_gazebo.physics import elements
from bullet_gazebo.physics.description import (
    Color,
    DescriptionError,
    Inertia,
    Joint,
    Link,
    ModelDescription,
    Shape,
)
from bullet_gazebo.physics.elements import finite, named, numbers, parse_xml, positive
from bullet_gazebo.physics.files.urdf_extensions import apply_extensions
from bullet_gazebo.physics.mechanics.lumping import lump_fixed_joints
from bullet_gazebo.physics.mechanics.tree import find_roots, unique
from bullet_gazebo.physics.meshes.mesh_files import MeshFinder, Resources
from bullet_gazebo.physics.pose import Pose, from_rpy

KINDS = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar")
WORLD = "world"


def parse_urdf(
    text: str, source: str = "URDF", resources: Resources | None = None
) -> ModelDescription:
    """Returns the model that `text` describes, its fixed joints lumped as Gazebo does.

    `resources` finds mesh files.

    Raises:
        DescriptionError: if it can't be simulated: `source`, the place and the fault, in one line.
    """
    with elements.place(source):
        return read_urdf(parse_xml(text), resources or Resources())


def read_urdf(robot: Element, resources: Resources, folder: Path | None = None) -> ModelDescription:
    """As parse_urdf, from the root element; relative mesh names are looked up in `folder`."""
    if robot.tag != "robot":
        raise DescriptionError(f"the root element is <{robot.tag}>, not <robot>")
    meshes = MeshFinder(resources, folder)
    materials = {m.get("name", ""): _rgba(m) for m in robot.findall("material")}
    links = unique((_link(e, materials, meshes) for e in robot.findall("link")), "link")
    joints = unique((_joint(e) for e in robot.findall("joint")), "joint")
    roots = find_roots(links, joints)
    if len(roots) > 1:
        raise DescriptionError(f"links {roots[:10]} all have no parent joint; one root is needed")
    model = ModelDescription(robot.get("name", ""), links, joints, roots[0])
    model.warnings = meshes.warnings
    model.initial_pose = _origin(robot, "robot")
    apply_extensions(model, robot)
    return lump_fixed_joints(model)


def _link(element: Element, materials: dict[str, Color | None], meshes: MeshFinder) -> Link:
    name = named(element, "link")
    place = f"link '{name}'"
    inertial = element.find("inertial")
    return Link(
        name=name,
        inertia=None if inertial is None else _inertia(inertial, place),
        collisions=_shapes(element, "collision", place, {}, meshes),
        visuals=_shapes(element, "visual", place, materials, meshes),
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


def _shapes(
    link: Element, tag: str, place: str, materials: dict[str, Color | None], meshes: MeshFinder
) -> list[Shape]:
    shapes = (_shape(e, f"{place}, {tag}", materials, meshes) for e in link.findall(tag))
    return [shape for shape in shapes if shape is not None]


def _shape(
    element: Element, place: str, materials: dict[str, Color | None], meshes: MeshFinder
) -> Shape | None:
    """Returns None for a visual whose mesh is missing."""
    geometry = element.find("geometry")
    if geometry is None or len(geometry) == 0:
        raise DescriptionError(f"{place}: <geometry> with a shape is missing")
    solid, mesh, collides = geometry[0], "", element.tag == "collision"
    size = _size(solid, place)
    if collides and solid.tag != "mesh":
        positive(size, f"{place}, {solid.tag}")
    if solid.tag == "mesh":
        found = meshes.find(solid.get("filename", ""), place, needed=collides)
        if found is None:
            return None
        mesh = found
    material, rgba = element.find("material"), None
    if material is not None:
        rgba = _rgba(material) or materials.get(material.get("name", ""))
    return Shape(solid.tag, size, _origin(element, place), mesh, rgba, element.get("name", ""))


def _size(solid: Element, place: str) -> tuple[float, ...]:
    if solid.tag == "box":
        return _numbers(solid, "size", place, 3)
    if solid.tag == "cylinder":
        return tuple(_number(solid, key, place, required=True) for key in ("radius", "length"))
    if solid.tag == "sphere":
        return (_number(solid, "radius", place, required=True),)
    if solid.tag == "mesh":
        return _numbers(solid, "scale", place, 3) if solid.get("scale") else (1.0, 1.0, 1.0)
    raise DescriptionError(f"{place}: geometry <{solid.tag}> is not known")


def _joint(element: Element) -> Joint:
    name = named(element, "joint")
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


def _origin(element: Element, place: str) -> Pose:
    origin = element.find("origin")
    if origin is None:
        return Pose()
    position = _numbers(origin, "xyz", place, 3) if origin.get("xyz") else (0.0, 0.0, 0.0)
    rpy = _numbers(origin, "rpy", place, 3) if origin.get("rpy") else (0.0, 0.0, 0.0)
    return Pose((position[0], position[1], position[2]), from_rpy(*rpy))


def _rgba(material: Element) -> Color | None:
    color = material.find("color")
    if color is None:
        return None
    r, g, b, a = _numbers(color, "rgba", f"material '{material.get('name', '')}'", 4)
    return (r, g, b, a)


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
    return finite(text, f"{place}: <{element.tag} {key}>")


def _numbers(element: Element, key: str, place: str, count: int) -> tuple[float, ...]:
    return numbers(element.get(key), f"{place}: <{element.tag} {key}>", count)
