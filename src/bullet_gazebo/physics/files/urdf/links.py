"""Links of a URDF. A part of one that can't be read is left out of it, with a warning; the link stays."""

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import TypeVar
from xml.etree.ElementTree import Element

from bullet_gazebo.physics.description import (
    Color,
    DescriptionError,
    Inertia,
    LimitExceeded,
    Link,
    Shape,
)
from bullet_gazebo.physics.elements import files_named_by_a_model, named, positive, shown
from bullet_gazebo.physics.files.reading import Reading
from bullet_gazebo.physics.files.urdf.values import read_number, read_numbers, read_origin
from bullet_gazebo.physics.meshes.mesh_files import MeshFinder

MOMENTS = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")

Part = TypeVar("Part")


@dataclass
class LinkReader:
    """Reads the links of one robot."""

    meshes: MeshFinder
    reading: Reading
    warnings: list[str]
    _materials: dict[str, Color | None] = field(default_factory=dict)

    def learn_materials(self, robot: Element) -> None:
        """Keeps the colours that visuals refer to by name."""
        for material in robot.findall("material"):
            name = material.get("name", "")
            self._materials[name] = self._or_none(_rgba, material, f"material '{shown(name)}'")
        for material in robot.iterfind(
            "link/visual/material"
        ):  # the first link that gives a colour
            name = material.get("name", "")
            if name and name not in self._materials:
                with suppress(DescriptionError):  # its link's reading tells
                    color = _rgba(material, name)
                    if color is not None:
                        self._materials[name] = color

    def read(self, element: Element) -> Link:
        """Reads one link.

        Raises:
            DescriptionError: if it has no name, or a collision's mesh can't be used.
        """
        self.reading.check()
        link = Link(named(element, "link"))
        place = f"link '{link.name}'"
        inertial = element.find("inertial")
        if inertial is not None:
            link.inertia = self._or_none(_inertia, inertial, f"{place}, inertial")
            if link.inertia is not None:
                _check_possible(link.inertia, f"{place}, inertial")
        link.collisions = list(self._shapes(element, "collision", place))
        link.visuals = list(self._shapes(element, "visual", place))
        return link

    def _or_none(
        self, read: Callable[[Element, str], Part | None], element: Element, place: str
    ) -> Part | None:
        """What `read` makes of `element`; None, and a warning, if that can't be read."""
        try:
            return read(element, place)
        except LimitExceeded:
            raise
        except DescriptionError as error:
            self.warnings.append(f"{error}; it is left out")
            return None

    def _shapes(self, link: Element, tag: str, place: str) -> Iterator[Shape]:
        place = f"{place}, {tag}"
        for element in link.findall(tag):
            self.reading.check()
            shape = self._or_none(_shape, element, place)
            if shape is not None and shape.kind == "mesh":
                shape = self._with_mesh(shape, element, place)
            if shape is not None:
                yield replace(shape, rgba=self._color(element, place))

    def _with_mesh(self, shape: Shape, element: Element, place: str) -> Shape | None:
        """None for a visual whose mesh is missing."""
        uri, needed = _solid(element, place).get("filename", ""), element.tag == "collision"
        try:
            with files_named_by_a_model(place):
                found = self.meshes.find(uri, place, needed)
        except DescriptionError as error:
            if needed:
                raise
            self.warnings.append(f"{error}; it is left out")
            return None
        return None if found is None else replace(shape, mesh=found[0], solid=found[1])

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
    moments = {key: read_number(tensor, key, place) for key in MOMENTS}
    value = read_number(mass, "value", place, required=True)
    return Inertia(mass=value, com=read_origin(inertial, place), **moments)


def _check_possible(inertia: Inertia, place: str) -> None:
    """What can be read, and no body has, refuses the robot: Gazebo's engine ends there."""
    if min(inertia.mass, inertia.ixx, inertia.iyy, inertia.izz) < 0.0:
        raise DescriptionError(f"{place}: mass and moments of inertia can't be negative")


def _shape(element: Element, place: str) -> Shape:
    """The shape without its mesh file and colour."""
    solid = _solid(element, place)
    size = _size(solid, place)
    if element.tag == "collision":  # of size 0 there is nothing to touch
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
