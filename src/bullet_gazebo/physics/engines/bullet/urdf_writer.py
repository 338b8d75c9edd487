"""Writes a ModelDescription as the URDF that the engine reads: lumped, without Gazebo's extensions."""

from dataclasses import replace
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from bullet_gazebo.physics.description import (
    DescriptionError,
    Inertia,
    Joint,
    Link,
    ModelDescription,
    Shape,
)
from bullet_gazebo.physics.meshes.mesh_files import drum, engine_mesh
from bullet_gazebo.physics.pose import Pose, to_rpy

MARGIN = 0.001  # [m]; PyBullet's, around convex hulls


def write_urdf(model: ModelDescription, folder: Path | None = None) -> str:
    """Returns URDF text with the numbers of `model` to the last digit.

    Meshes that the engine can't read as they are get rewritten into `folder`, if one is given.

    Raises:
        DescriptionError: for a mesh that can't be read.
    """
    robot = Element("robot", name="model")
    for link in model.links.values():
        _write_link(robot, link, model.static, folder)
    for joint in model.joints.values():
        _write_joint(robot, joint)
    indent(robot)  # the engine reads lines of up to 8 KiB and breaks longer ones anywhere
    return tostring(robot, encoding="unicode")


def _write_link(robot: Element, link: Link, static: bool, folder: Path | None) -> None:
    element = SubElement(robot, "link", name=link.name)
    # Without an inertial the engine would assume 1 kg; only the immovable link `world` has none.
    _write_inertia(element, link.inertia or Inertia(mass=0.0))
    for tag, shapes in (("visual", link.visuals), ("collision", link.collisions)):
        for given in shapes:
            shape = _finer(given, folder) if tag == "collision" else given
            mesh = _mesh_file(shape, folder, needed=tag == "collision")
            if mesh is None:
                continue
            written = SubElement(element, tag)
            if static and shape.kind == "mesh" and tag == "collision":
                written.set("concave", "yes")  # what moves collides by its convex hull
            _write_shape(written, shape, mesh)


def _finer(shape: Shape, folder: Path | None) -> Shape:
    """The engine's own cylinder has 32 sides: a wheel rocks on them, and each one brakes it.

    Around a mesh the engine keeps a margin, by which a wheel would roll too far.
    """
    if shape.kind != "cylinder" or folder is None:
        return shape
    radius, length = max(shape.size[0] - MARGIN, 0.5 * shape.size[0]), shape.size[1]
    length = max(length - 2.0 * MARGIN, 0.5 * length)
    return replace(shape, kind="mesh", size=(radius, radius, length), mesh=str(drum(folder)))


def _mesh_file(shape: Shape, folder: Path | None, needed: bool) -> str | None:
    """Returns the file that the engine reads; None for that of a visual that it can't read."""
    if shape.kind != "mesh" or folder is None:
        return shape.mesh
    try:
        return str(engine_mesh(Path(shape.mesh), folder))
    except DescriptionError:
        if needed:
            raise
        return None


def _write_inertia(link: Element, inertia: Inertia) -> None:
    inertial = SubElement(link, "inertial")
    _write_origin(inertial, inertia.com)
    SubElement(inertial, "mass", value=repr(inertia.mass))
    tensor = {
        key: repr(getattr(inertia, key)) for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    }
    SubElement(inertial, "inertia", tensor)


def _write_shape(element: Element, shape: Shape, mesh: str) -> None:
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
        SubElement(geometry, "mesh", filename=mesh, scale=_words(shape.size))
    if shape.rgba is not None:
        material = SubElement(element, "material", name=f"rgba {_words(shape.rgba)}")
        SubElement(material, "color", rgba=_words(shape.rgba))


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
