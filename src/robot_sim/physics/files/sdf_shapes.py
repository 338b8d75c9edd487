"""Collisions and visuals of SDF models."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from xml.etree.ElementTree import Element

from robot_sim.physics.description import Color, DescriptionError, LimitExceeded, Shape
from robot_sim.physics.files.elements import direction, numbers, place, positive, shown, truth
from robot_sim.physics.files.meshes import IMAGES, Submesh, make_mesh
from robot_sim.physics.files.own_models import model_of_mesh
from robot_sim.physics.files.reading import MeshFile, MeshFinder
from robot_sim.physics.files.sdf_parts import Frames, material_color, read_color, read_pose, value
from robot_sim.physics.pose import Pose, Quaternion, z_onto

GEOMETRIES = (
    "box", "cylinder", "sphere", "plane", "mesh", "heightmap", "polyline",
    "capsule", "ellipsoid",  # of SDF 1.8
)  # fmt: skip
FILES = ("mesh", "heightmap")
SHEET = 0.001  # [m]; thickness of a plane that is only seen
NO_NAME = "__default__"  # of a submesh: as if it weren't there


@dataclass
class ShapeReader:
    """Reads the collisions and visuals of the links of one model."""

    meshes: MeshFinder
    frames: Frames

    def read(self, link: Element, tag: str, where: str) -> Iterator[Shape]:
        """Yields the shapes; a visual that can't be shown is a warning."""
        for element in link.findall(tag):
            here = f"{where}, {tag} '{shown(element.get('name', ''))}'"
            self.meshes.reading.check()
            try:
                shape = self._shape(element, link, here)
            except DescriptionError as error:
                if tag == "collision" or isinstance(error, LimitExceeded):
                    raise
                self.meshes.warnings.append(f"{error}; it is left out")
                continue
            if shape is not None:
                yield from self._primitives(shape)

    def _primitives(self, shape: Shape) -> Iterator[Shape]:
        """Yields the cylinder and the two balls that are a capsule; others as `_simplified`."""
        if shape.kind != "capsule":
            yield from self._simplified(shape)
            return
        radius, length = shape.size
        yield replace(shape, kind="cylinder")
        for number, end in enumerate((0.5 * length, -0.5 * length), 1):
            pose = shape.pose.compose(Pose((0.0, 0.0, end)))
            name = f"{shape.name}_{number}"
            yield replace(shape, kind="sphere", size=(radius,), pose=pose, name=name)

    def _simplified(self, shape: Shape) -> Iterator[Shape]:
        """Yields the simple shapes of our own model in place of a mesh of it that isn't there.

        They have its size: Gazebo's models scale their meshes, each by another factor.
        """
        model = model_of_mesh(shape.mesh) if shape.kind == "mesh" else None
        if model is None:
            yield shape
            return
        self.meshes.stand_ins.append(model.get("folder", ""))
        red, green, blue, alpha = numbers(model.get("rgba", ""), "rgba", 4)
        rgba = shape.rgba or (red, green, blue, alpha)
        origin = Pose((0.0, 0.0, -float(model.get("origin", 0.0))))
        for number, element in enumerate(model.iterfind("link/collision")):
            part = self._shape(element, model, "")
            assert part is not None
            yield replace(
                shape,
                kind=part.kind,
                size=part.size,
                pose=shape.pose.compose(origin).compose(part.pose),
                mesh="",
                rgba=rgba,
                name=f"{shape.name}_{part.name}" if number else shape.name,
            )

    def _shape(self, element: Element, link: Element, where: str) -> Shape | None:
        geometry = element.find("geometry")
        if geometry is None or len(geometry) == 0:
            raise DescriptionError(f"{where}: <geometry> with a shape is missing")
        solid, collides = geometry[0], element.tag == "collision"
        if solid.tag == "empty":
            return None
        if solid.tag not in GEOMETRIES:
            self.meshes.warnings.append(
                f"{where}: geometry <{shown(solid.tag)}> is not simulated; it is left out"
            )
            return None
        pose, relative_to = read_pose(element, where)
        if relative_to and relative_to != link.get("name", ""):
            frame = self.frames.resolve(relative_to)
            pose = frame.compose(pose).relative_to(self.frames.resolve(link.get("name", "")))
        kind, size = solid.tag, _size(solid, where)
        mesh: MeshFile = ("", None)
        if solid.tag == "plane":
            pose = pose.compose(Pose(orientation=_onto_normal(solid, where)))
            if not collides:
                if link.find("collision/geometry/plane") is not None:
                    return None  # that one is shown, without end
                pose = pose.compose(Pose((0.0, 0.0, -0.5 * SHEET)))
                sides = numbers(solid.findtext("size", "1 1"), f"{where}: <size>", 2)
                kind, size = "box", positive((*sides, SHEET), where)
        elif solid.tag in FILES:
            found = self._mesh(solid, where, collides)
            if found is None:
                return None
            kind, mesh = "mesh", found
            if solid.tag == "heightmap":
                x, y, z = numbers(solid.findtext("pos", "0 0 0"), f"{where}: <pos>", 3)
                pose = pose.compose(Pose((x, y, z)))
                positive(size[:2], f"{where}, heightmap")
        elif solid.tag == "polyline":
            outline = _outline(geometry, where)
            with place(f"{where}, polyline"):
                kind, mesh = "mesh", make_mesh("polyline", *outline)
        else:
            positive(size, f"{where}, {solid.tag}")
            if solid.tag == "ellipsoid":
                kind, mesh = "mesh", make_mesh("ellipsoid")
        color = _color(element, where, self.meshes.warnings)
        name = element.get("name", "")
        shape = Shape(kind, size, pose, mesh[0], color, name, solid=mesh[1] if collides else None)
        if not collides:
            return shape
        retro = value(element, "laser_retro", where, 0.0)
        return replace(
            shape,
            mu=_not_negative(element, "surface/friction/ode/mu", where, "friction", shape.mu),
            max_vel=_not_negative(element, "surface/contact/ode/max_vel", where, "max_vel", shape.max_vel),
            retro=retro,
        )

    def _mesh(self, solid: Element, where: str, collides: bool) -> MeshFile | None:
        """Returns the file of a mesh or of a height map, and what collides of it."""
        uri = solid.findtext("uri") or ""
        if solid.tag == "heightmap":
            samples = max(1, int(value(solid, "sampling", where, 2.0)))
            return self.meshes.find(uri, where, collides, samples, IMAGES)
        if model_of_mesh(uri) is not None and self.meshes.is_missing(uri):
            return uri, None
        name = (solid.findtext("submesh/name") or "").strip()
        part = Submesh(name, truth(solid.findtext("submesh/center")))
        return self.meshes.find(uri, where, collides, None if name in ("", NO_NAME) else part)


def _not_negative(collision: Element, path: str, where: str, name: str, default: float) -> float:
    number = value(collision, path, where, default)
    if number < 0.0:
        raise DescriptionError(f"{where}: a {name} of {number} is negative")
    return number


def _size(solid: Element, where: str) -> tuple[float, ...]:
    where = f"{where}, {solid.tag}"
    if solid.tag in ("box", "heightmap"):
        return numbers(solid.findtext("size", "1 1 1"), f"{where}: <size>", 3)
    if solid.tag in ("cylinder", "capsule"):
        return (value(solid, "radius", where, 1.0), value(solid, "length", where, 1.0))
    if solid.tag == "sphere":
        return (value(solid, "radius", where, 1.0),)
    if solid.tag in ("mesh", "ellipsoid"):
        name = "scale" if solid.tag == "mesh" else "radii"
        return numbers(solid.findtext(name, "1 1 1"), f"{where}: <{name}>", 3)
    return () if solid.tag == "plane" else (1.0, 1.0, 1.0)


def _outline(geometry: Element, where: str) -> tuple[list[list[tuple[float, ...]]], float]:
    """Returns the loops of all polylines of a shape, and the height of the first."""
    here = f"{where}, polyline"
    loops = [
        [numbers(point.text, f"{here}: <point>", 2) for point in each.findall("point")]
        for each in geometry.findall("polyline")
    ]
    return loops, positive((value(geometry[0], "height", here, 1.0),), here)[0]


def _onto_normal(plane: Element, where: str) -> Quaternion:
    """Returns the shortest rotation of z onto the plane's normal."""
    normal = numbers(plane.findtext("normal", "0 0 1"), f"{where}: <normal>", 3)
    direction(normal, f"{where}: the plane's normal")  # refuses one that has none
    return z_onto(normal)


def _color(element: Element, where: str, warnings: list[str]) -> Color | None:
    text = element.findtext("material/diffuse") or ""
    if text.strip():
        return read_color(text, f"{where}: <diffuse>")
    return material_color(element.findtext("material/script/name", "").strip(), warnings)
