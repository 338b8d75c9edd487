"""Writes a ModelDescription as the URDF that the engine reads: lumped, without Gazebo's extensions."""

from xml.etree.ElementTree import Element, SubElement, tostring

from bullet_gazebo.physics.description import Inertia, Joint, Link, ModelDescription, Shape
from bullet_gazebo.physics.pose import Pose, to_rpy


def write_urdf(model: ModelDescription) -> str:
    """Returns URDF text with the numbers of `model` to the last digit."""
    robot = Element("robot", name=model.name or "model")
    for link in model.links.values():
        _write_link(robot, link)
    for joint in model.joints.values():
        _write_joint(robot, joint)
    return tostring(robot, encoding="unicode")


def _write_link(robot: Element, link: Link) -> None:
    element = SubElement(robot, "link", name=link.name)
    # Without an inertial the engine would assume 1 kg; only the immovable link `world` has none.
    _write_inertia(element, link.inertia or Inertia(mass=0.0))
    for tag, shapes in (("visual", link.visuals), ("collision", link.collisions)):
        for shape in shapes:
            _write_shape(SubElement(element, tag), shape)


def _write_inertia(link: Element, inertia: Inertia) -> None:
    inertial = SubElement(link, "inertial")
    _write_origin(inertial, inertia.com)
    SubElement(inertial, "mass", value=repr(inertia.mass))
    tensor = {
        key: repr(getattr(inertia, key)) for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    }
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
    else:
        SubElement(geometry, "mesh", filename=shape.mesh, scale=_words(shape.size))
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
