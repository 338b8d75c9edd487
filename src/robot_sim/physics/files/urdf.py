"""The reader of URDF (wiki.ros.org/urdf/XML); lumps fixed joints as Gazebo does.

Faults are treated as urdfdom and sdformat do (docs/differences.md lists exceptions): a shape or inertial
that can't be read is left out of its link with a warning; a joint that can't be read refuses the robot.
"""

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import TypeVar
from xml.etree.ElementTree import Element

from robot_sim.physics.description import (
    Color,
    DescriptionError,
    Inertia,
    Joint,
    LimitExceeded,
    Link,
    ModelDescription,
    Shape,
)
from robot_sim.physics.engine_form import check_shapes
from robot_sim.physics.files import elements
from robot_sim.physics.files.element_table import without_effect
from robot_sim.physics.files.elements import (
    TINY,
    direction,
    finite,
    mended,
    named,
    numbers,
    positive,
    rename_lumped,
    shown,
)
from robot_sim.physics.files.mechanisms import add_mechanisms
from robot_sim.physics.files.motion import settle_kinematic
from robot_sim.physics.files.reading import MeshFinder, Reading, Resources
from robot_sim.physics.files.urdf_extensions import add_extension_joints, apply_extensions
from robot_sim.physics.lumping import find_roots, lump_fixed_joints, unique
from robot_sim.physics.pose import Pose, from_rpy

KINDS = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar")
CHECKED = {  # elements that urdfdom reads with the joint, and their numbers
    "mimic": ("multiplier", "offset"),
    "calibration": ("rising", "falling"),
    "safety_controller": ("soft_lower_limit", "soft_upper_limit", "k_position", "k_velocity"),
}
MOMENTS = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
Part = TypeVar("Part")


def read_origin(element: Element, place: str) -> Pose:
    """Returns the `<origin>` of `element`; its attributes default to zero."""
    origin = element.find("origin")
    if origin is None:
        return Pose()
    x, y, z = read_numbers(origin, "xyz", place, 3) if origin.get("xyz") else (0.0, 0.0, 0.0)
    rpy = read_numbers(origin, "rpy", place, 3) if origin.get("rpy") else (0.0, 0.0, 0.0)
    return Pose((x, y, z), from_rpy(*rpy))


def read_number(element: Element, key: str, place: str, required: bool = False) -> float:
    """Returns the number in attribute `key`; 0 if it is missing and not `required`."""
    text = element.get(key)
    if text is None:
        if required:
            raise DescriptionError(f"{place}: <{element.tag}> needs the attribute '{key}'")
        return 0.0
    return finite(text, f"{place}: <{element.tag} {key}>")


def read_numbers(element: Element, key: str, place: str, count: int) -> tuple[float, ...]:
    return numbers(element.get(key), f"{place}: <{element.tag} {key}>", count)


def read_joint(element: Element, warnings: list[str]) -> Joint:
    """Returns the joint of a `<joint>` element."""
    name = named(element, "joint")
    place = f"joint '{name}'"
    kind = element.get("type", "")
    if kind not in KINDS:
        raise DescriptionError(f"{place}: type '{shown(kind)}' is not one of {', '.join(KINDS)}")
    joint = Joint(
        name=name,
        kind=kind,
        parent=_referred_link(element, "parent", place),
        child=_referred_link(element, "child", place),
        pose=read_origin(element, place),
    )
    axis, dynamics = element.find("axis"), element.find("dynamics")
    if axis is not None and joint.movable:
        joint.axis = direction(read_numbers(axis, "xyz", place, 3), f"{place}: the axis")
    _set_limit(joint, element, place, warnings)
    if dynamics is not None:
        joint.damping = read_number(dynamics, "damping", place)
        joint.friction = read_number(dynamics, "friction", place)
    _check_others(element, place)
    return joint


def _set_limit(joint: Joint, element: Element, place: str, warnings: list[str]) -> None:
    limit = element.find("limit")
    if limit is None:
        if joint.bounded:
            raise DescriptionError(f"{place}: a {joint.kind} joint needs <limit>")
        return
    place = f"{place}, limit"
    joint.effort = read_number(limit, "effort", place, required=True)
    joint.velocity = read_number(limit, "velocity", place, required=True)
    if not joint.bounded:  # a continuous joint ignores lower and upper
        return
    lower, upper = read_number(limit, "lower", place), read_number(limit, "upper", place)
    if lower > upper:
        warnings.append(f"{place}: lower {lower} is above upper {upper}; the two are swapped")
    joint.lower, joint.upper = min(lower, upper), max(lower, upper)


def _check_others(element: Element, place: str) -> None:
    """Refuses what urdfdom, and so other programs, can't read."""
    for tag, keys in CHECKED.items():
        child = element.find(tag)
        if child is None:
            continue
        if tag == "mimic" and not child.get("joint"):
            raise DescriptionError(f"{place}: <mimic> needs the attribute 'joint'")
        for key in keys:
            read_number(child, key, place, required=key == "k_velocity")


def _referred_link(element: Element, role: str, place: str) -> str:
    child = element.find(role)
    if child is None or not child.get("link"):
        raise DescriptionError(f"{place}: <{role} link=…> is missing")
    return child.get("link", "")


@dataclass
class LinkReader:
    """Reads the links of one robot."""

    meshes: MeshFinder
    _materials: dict[str, Color | None] = field(default_factory=dict)

    def learn_materials(self, robot: Element) -> None:
        """Collects the colours that visuals refer to by name."""
        for material in robot.findall("material"):
            name = material.get("name", "")
            self._materials[name] = self._or_none(_rgba, material, f"material '{shown(name)}'")
        for material in robot.iterfind("link/visual/material"):  # the first that gives a colour
            name = material.get("name", "")
            if name and name not in self._materials:
                with suppress(DescriptionError):  # reading its link will report it
                    color = _rgba(material, name)
                    if color is not None:
                        self._materials[name] = color

    def read(self, element: Element) -> Link:
        """Reads one link."""
        self.meshes.reading.check()
        link = Link(named(element, "link"))
        place = f"link '{link.name}'"
        inertial = element.find("inertial")
        if inertial is not None:
            link.inertia = body = self._or_none(_inertia, inertial, f"{place}, inertial")
            # Gazebo's engine crashes over it.
            if body is not None and min(body.mass, body.ixx, body.iyy, body.izz) < -TINY:
                raise DescriptionError(f"{place}, inertial: mass and moments of inertia can't be negative")
        link.collisions = list(self._shapes(element, "collision", place))
        link.visuals = list(self._shapes(element, "visual", place))
        return link

    def _or_none(
        self, read: Callable[[Element, str], Part | None], element: Element, place: str
    ) -> Part | None:
        """Returns `read(element, place)`; None, and a warning, if the element can't be read."""
        try:
            return read(element, place)
        except LimitExceeded:
            raise
        except DescriptionError as error:
            self.meshes.warnings.append(f"{error}; it is left out")
            return None

    def _shapes(self, link: Element, tag: str, place: str) -> Iterator[Shape]:
        place = f"{place}, {tag}"
        for element in link.findall(tag):
            self.meshes.reading.check()
            shape = self._or_none(_shape, element, place)
            if shape is not None and shape.kind == "mesh":
                uri = _solid(element, place).get("filename", "")
                mesh = self.meshes.find(uri, place, needed=tag == "collision")
                shape = mesh and replace(shape, mesh=mesh[0], solid=mesh[1])
            if shape is not None:
                yield replace(shape, rgba=self._color(element, place))

    def _color(self, element: Element, place: str) -> Color | None:
        material = element.find("material")
        if material is None:
            return None
        own = self._or_none(_rgba, material, f"{place}, material")
        return own or self._materials.get(material.get("name", ""))


def _inertia(inertial: Element, place: str) -> Inertia:
    mass, tensor = inertial.find("mass"), inertial.find("inertia")
    if mass is None:
        raise DescriptionError(f"{place}: <mass> is missing")
    if tensor is None:
        raise DescriptionError(f"{place}: <inertia> is missing")
    moments = mended({key: read_number(tensor, key, place) for key in MOMENTS})
    value = read_number(mass, "value", place, required=True)
    return Inertia(mass=value, com=read_origin(inertial, place), **moments)


def _shape(element: Element, place: str) -> Shape:
    """Returns the shape without its mesh and colour."""
    solid = _solid(element, place)
    size = _size(solid, place)
    if element.tag == "collision":  # a visual may have size 0
        positive(tuple(map(abs, size)) if solid.tag == "mesh" else size, f"{place}, {solid.tag}")
    name = element.get("name", "")
    return Shape(solid.tag, size, read_origin(element, place), name=name)


def _solid(element: Element, place: str) -> Element:
    geometry = element.find("geometry")
    if geometry is None or len(geometry) == 0:
        raise DescriptionError(f"{place}: <geometry> with a shape is missing")
    return geometry[0]


def _size(solid: Element, place: str) -> tuple[float, ...]:
    if solid.tag == "box":
        return read_numbers(solid, "size", place, 3)
    if solid.tag == "cylinder":
        return tuple(read_number(solid, key, place, required=True) for key in ("radius", "length"))
    if solid.tag == "sphere":
        return (read_number(solid, "radius", place, required=True),)
    if solid.tag == "mesh":
        if not solid.get("filename"):
            raise DescriptionError(f"{place}: <mesh> needs the attribute 'filename'")
        return read_numbers(solid, "scale", place, 3) if solid.get("scale") else (1.0, 1.0, 1.0)
    raise DescriptionError(f"{place}: geometry <{shown(solid.tag)}> is not known")


def _rgba(material: Element, place: str) -> Color | None:
    color = material.find("color")
    if color is None:
        return None
    r, g, b, a = read_numbers(color, "rgba", place, 4)
    return (r, g, b, a)


def parse_urdf(
    text: str | bytes, source: str = "URDF", resources: Resources | None = None
) -> ModelDescription:
    """Returns the model that `text` describes, its fixed joints lumped as Gazebo does.

    `resources` finds mesh files.

    Raises:
        DescriptionError: If it can't be simulated: `source`, the place and the fault, in one line.
    """
    reading = Reading()
    with elements.place(source):
        return read_urdf(reading.parse(text), resources or Resources(), reading)


def read_urdf(robot: Element, resources: Resources, reading: Reading) -> ModelDescription:
    """As parse_urdf, from the root element."""
    if robot.tag != "robot":
        raise DescriptionError(f"the root element is <{shown(robot.tag)}>, not <robot>")
    warnings: list[str] = []
    reader = LinkReader(MeshFinder(resources, reading, warnings=warnings))
    reader.learn_materials(robot)
    links = unique(map(reader.read, robot.findall("link")), "link")
    check_shapes(links.values())

    def read(element: Element) -> Joint:
        reading.check()
        return read_joint(element, warnings)

    joints = unique(map(read, robot.findall("joint")), "joint")
    roots = find_roots(links, joints)
    if len(roots) > 1:
        raise DescriptionError(f"links {roots[:10]} all have no parent joint; one root is needed")
    model = ModelDescription(robot.get("name", ""), links, joints, roots[0], warnings=warnings)
    model.initial_pose = read_origin(robot, "robot")
    apply_extensions(model, robot)
    reading.check()
    try:
        lumped = lump_fixed_joints(model)
    except DescriptionError as error:
        if not warnings:
            raise
        # A root without mass is the consequence of an inertial that was left out.
        raise DescriptionError(f"{error}. Before that: {warnings[0]}") from error
    for plugin in model.plugins:
        try:
            rename_lumped(plugin.element, model.lumped)
        except DescriptionError as error:
            warnings.append(f"plugin {shown(plugin.filename)}: {error}")
    add_extension_joints(lumped, robot)
    settle_kinematic(lumped)
    add_mechanisms(lumped, robot)
    lumped.warnings[:0] = without_effect(robot, "robot")
    reading.split_meshes(lumped)
    return lumped
