"""Joints of a URDF. One that can't be read refuses the robot, as in urdfdom."""

import math
from xml.etree.ElementTree import Element

from bullet_gazebo.physics.description import DescriptionError, Joint
from bullet_gazebo.physics.elements import named, shown
from bullet_gazebo.physics.files.urdf.values import read_number, read_numbers, read_origin

KINDS = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar")
UNUSED = {  # what the physics doesn't act on, and urdfdom reads: element, its numbers
    "mimic": ("multiplier", "offset"),
    "calibration": ("rising", "falling"),
    "safety_controller": ("soft_lower_limit", "soft_upper_limit", "k_position", "k_velocity"),
}


def read_joint(element: Element, warnings: list[str]) -> Joint:
    """Returns the joint of a `<joint>` element.

    Raises:
        DescriptionError: if it can't be read; the text names place and fault.
    """
    name = named(element, "joint")
    place = f"joint '{name}'"
    kind = element.get("type", "")
    if kind not in KINDS:
        raise DescriptionError(f"{place}: type '{shown(kind)}' is none of {', '.join(KINDS)}")
    joint = Joint(
        name=name,
        kind=kind,
        parent=_referred_link(element, "parent", place),
        child=_referred_link(element, "child", place),
        pose=read_origin(element, place),
    )
    _set_axis(joint, element, place)
    _set_limit(joint, element, place, warnings)
    _set_dynamics(joint, element, place)
    _check_unused(element, place)
    return joint


def _set_axis(joint: Joint, element: Element, place: str) -> None:
    axis = element.find("axis")
    if axis is None or not joint.movable:
        return
    x, y, z = read_numbers(axis, "xyz", place, 3)
    length = math.sqrt(x * x + y * y + z * z)
    if not 0.0 < length < math.inf:
        raise DescriptionError(f"{place}: the axis has length {length:g}")
    joint.axis = (x / length, y / length, z / length)


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


def _set_dynamics(joint: Joint, element: Element, place: str) -> None:
    dynamics = element.find("dynamics")
    if dynamics is not None:
        joint.damping = read_number(dynamics, "damping", place)
        joint.friction = read_number(dynamics, "friction", place)


def _check_unused(element: Element, place: str) -> None:
    """A robot that no other program could read is refused here, too."""
    for tag, keys in UNUSED.items():
        child = element.find(tag)
        if child is None:
            continue
        if tag == "mimic" and not child.get("joint"):
            raise DescriptionError(f"{place}: <mimic joint=…> is missing")
        for key in keys:
            read_number(child, key, place)


def _referred_link(element: Element, role: str, place: str) -> str:
    child = element.find(role)
    if child is None or not child.get("link"):
        raise DescriptionError(f"{place}: <{role} link=…> is missing")
    return child.get("link", "")
