"""Numbers and places in a URDF's attributes."""

from xml.etree.ElementTree import Element

from bullet_gazebo.physics.description import DescriptionError
from bullet_gazebo.physics.elements import finite, numbers
from bullet_gazebo.physics.pose import Pose, from_rpy


def read_origin(element: Element, place: str) -> Pose:
    """Returns the `<origin>` of `element`; none, or an attribute that is missing, is zero."""
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
