"""URDF and mesh files for PyBullet."""

from dataclasses import replace
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement, indent, tostring

import numpy as np

from robot_sim.physics.description import Inertia, Joint, Link, Mesh, ModelDescription, Shape
from robot_sim.physics.files.meshes import stl
from robot_sim.physics.pose import Pose, to_rpy

TURNING = ("revolute", "continuous")
UNSEEN = 0.001  # [m]
TREAD = 1e-6  # [m]; much less than contacts yield, so the whole line carries


def write_mesh(mesh: Mesh, folder: Path, concave: bool, objects: bool) -> str:
    """Writes a mesh into `folder` and returns the file's name.

    PyBullet loads large meshes, and several in a link, only from files. It sorts the points of an OBJ file,
    and takes those of an STL file in their order. The order affects the last bits of contacts, so a mesh
    from an OBJ file is written as one.

    Args:
        concave: Whether to write its triangles instead of its hulls.
        objects: Whether it came from an OBJ file, or is in pieces.
    """
    path = folder / f"{mesh.digest}.{'stl' if concave or not objects else 'obj'}"
    if path.exists():
        return str(path)
    if concave:
        path.write_bytes(stl(mesh.vertices, mesh.faces))
    elif objects:
        path.write_text(_obj(mesh), encoding="ascii")
    else:
        points = np.concatenate(mesh.hulls)
        around = np.arange(-(-len(points) // 3) * 3) % len(points)
        path.write_bytes(stl(points, around.reshape(-1, 3)))
    return str(path)


def _obj(mesh: Mesh) -> str:
    """Returns an OBJ text with an object for each hull. Faces only list the points."""
    lines, start = [], 1
    for number, points in enumerate(mesh.hulls):
        lines.append(f"o {number}")
        lines += [f"v {x!r} {y!r} {z!r}" for x, y, z in points.tolist()]
        corners = [f"{start + i % len(points)}" for i in range(len(points) + 2)]
        lines += [f"f {' '.join(corners[i : i + 3])}" for i in range(len(points))]
        start += len(points)
    return "\n".join([*lines, ""])


def write_urdf(model: ModelDescription, folder: Path) -> str:
    """Returns URDF text with the numbers of `model` to the last digit.

    Visuals are left out: nothing is drawn. Meshes are written into `folder`. PyBullet never
    opens a user's file: it would crash over a broken one, and cache an old one.
    """
    robot = Element("robot", name="model")
    turning = {joint.child for joint in model.joints.values() if joint.kind in TURNING}
    for link in model.links.values():
        shapes = link.collisions
        if link.name in turning:
            shapes = [part for shape in shapes for part in _treads(shape)]
        _write_link(robot, replace(link, collisions=shapes), model.static, folder)
    for joint in model.joints.values():
        _write_joint(robot, joint)
    indent(robot)  # PyBullet breaks lines of more than 8 KiB anywhere
    return tostring(robot, encoding="unicode")


def _treads(shape: Shape) -> list[Shape]:
    """Returns a cylinder, which may be a wheel, with a narrow tread in its middle.

    It touches along a line, of which PyBullet finds the ends only. A wheel that steers on the spot would turn
    about its outer one. The line's friction turns it about a point near its middle.
    """
    if shape.kind != "cylinder":
        return [shape]
    radius, length = shape.size
    return [
        replace(shape, size=(radius - min(TREAD, 0.5 * radius), length)),
        replace(shape, size=(radius, 0.1 * length)),
    ]


def _write_link(robot: Element, link: Link, static: bool, folder: Path) -> None:
    element = SubElement(robot, "link", name=link.name)
    # Without an inertial PyBullet would assume 1 kg; only the immovable link `world` has none.
    _write_inertia(element, link.inertia or Inertia(mass=0.0))
    if any(shape.solid for shape in link.collisions):  # or PyBullet keeps them twice, to draw them
        _write_shape(SubElement(element, "visual"), Shape("sphere", (UNSEEN,)))
    for shape in link.collisions:
        written = SubElement(element, "collision")
        if static and shape.kind == "mesh":
            written.set("concave", "yes")  # moving bodies collide by their convex hulls
        if shape.solid is not None:
            objects = shape.solid.in_pieces or Path(shape.mesh).suffix.lower() == ".obj"
            written_mesh = write_mesh(shape.solid, folder, concave=static, objects=objects)
            _write_shape(written, replace(shape, mesh=written_mesh))
        else:
            _write_shape(written, shape)


def _write_inertia(link: Element, inertia: Inertia) -> None:
    inertial = SubElement(link, "inertial")
    _write_origin(inertial, inertia.com)
    SubElement(inertial, "mass", value=repr(inertia.mass))
    tensor = {key: repr(getattr(inertia, key)) for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")}
    SubElement(inertial, "inertia", tensor)


def _write_shape(element: Element, shape: Shape) -> None:
    _write_origin(element, shape.pose)
    geometry = SubElement(element, "geometry")
    if shape.kind == "box":
        SubElement(geometry, "box", size=_words(shape.size))
    elif shape.kind == "cylinder":
        SubElement(geometry, "cylinder", radius=repr(shape.size[0]), length=repr(shape.size[1]))
    elif shape.kind == "sphere":
        SubElement(geometry, "sphere", radius=repr(shape.size[0]))
    elif shape.kind == "plane":
        SubElement(geometry, "plane", normal="0 0 1")
    else:
        SubElement(geometry, "mesh", filename=shape.mesh, scale=_words(shape.size))


def _write_joint(robot: Element, joint: Joint) -> None:
    element = SubElement(robot, "joint", name=joint.name, type=joint.kind)
    _write_origin(element, joint.pose)
    SubElement(element, "parent", link=joint.parent)
    SubElement(element, "child", link=joint.child)
    SubElement(element, "axis", xyz=_words(joint.axis))
    limit = {"effort": repr(joint.effort), "velocity": repr(joint.velocity)}
    if joint.bounded:
        limit |= {"lower": repr(joint.lower), "upper": repr(joint.upper)}
    SubElement(element, "limit", limit)


def _write_origin(element: Element, pose: Pose) -> None:
    SubElement(element, "origin", xyz=_words(pose.position), rpy=_words(to_rpy(pose.orientation)))


def _words(numbers: tuple[float, ...]) -> str:
    return " ".join(repr(float(number)) for number in numbers)
