"""What `<gazebo>` blocks of a URDF say beyond URDF: plugins, friction, gravity, kept fixed joints.

See docs/contract/gazebo.md 2.4. A value is the attribute `value`, or else the text. Sensors are out of scope:
they are listed in `left_out`.
"""

from dataclasses import replace
from xml.etree.ElementTree import Element

from bullet_gazebo.physics.description import (
    DescriptionError,
    Joint,
    Link,
    ModelDescription,
    Plugin,
)
from bullet_gazebo.physics.elements import finite, shown

YES = ("true", "yes", "1")
NO = ("false", "no", "0")


def apply_extensions(model: ModelDescription, robot: Element) -> None:
    """Writes what the `<gazebo>` children of `robot` say into `model`, before its joints are lumped.

    A reference to nothing is a warning, as in Gazebo.

    Raises:
        DescriptionError: if a value can't be read.
    """
    for block in robot.findall("gazebo"):
        reference = block.get("reference")
        if not reference:
            _apply_to_model(model, block)
        elif reference in model.links:
            _apply_to_link(model, model.links[reference], block)
        elif reference in model.joints:
            _apply_to_joint(model.joints[reference], block)
        else:
            model.warnings.append(
                f"<gazebo reference='{shown(reference)}'> refers to no link or joint"
            )


def read_plugin(element: Element) -> Plugin:
    return Plugin(element.get("filename", ""), element.get("name", ""), element)


def name_sensor(element: Element, owner: str) -> str:
    """Returns what to call a sensor that is left out."""
    kind, name = shown(element.get("type", "unknown")), shown(element.get("name", ""))
    return f"{kind} sensor '{name}' of {owner}"


def _apply_to_model(model: ModelDescription, block: Element) -> None:
    model.plugins += [read_plugin(element) for element in block.findall("plugin")]
    for element in block:
        if element.tag == "static":
            model.static = model.static or _value(element) in YES
        elif element.tag == "self_collide" and _value(element) in YES:
            for link in model.links.values():
                link.self_collide = True


def _apply_to_link(model: ModelDescription, link: Link, block: Element) -> None:
    for element in block:
        place = f"<gazebo reference='{shown(link.name)}'>, <{element.tag}>"
        if element.tag == "mu1":
            mu = _not_negative(_value(element), place)
            link.collisions = [replace(shape, mu=mu) for shape in link.collisions]
        elif element.tag == "turnGravityOff":
            link.gravity = (
                _value(element) in NO
            )  # whatever else stands there, or nothing, turns it off
        elif element.tag == "gravity":
            link.gravity = _value(element) in ("", *YES)
        elif element.tag == "selfCollide":
            link.self_collide = _value(element) in YES
        elif element.tag == "sensor":
            model.left_out.append(name_sensor(element, f"link '{shown(link.name)}'"))
        elif element.tag == "plugin":
            name = shown(element.get("filename", ""))
            model.left_out.append(f"plugin {name} of link '{shown(link.name)}'")


def _apply_to_joint(joint: Joint, block: Element) -> None:
    """A fixed joint is kept as it is, or as a hinge that can't turn."""
    if joint.kind != "fixed":
        return
    if _value(block.find("preserveFixedJoint")) in YES:
        joint.kept = True
    elif _value(block.find("disableFixedJointLumping")) in YES:
        joint.kind = "revolute"


def _value(element: Element | None) -> str:
    """The value of an extension, without blanks, in small letters."""
    if element is None:
        return ""
    return (element.get("value", element.text) or "").strip().lower()


def _not_negative(text: str, place: str) -> float:
    value = finite(text, place)
    if value < 0.0:
        raise DescriptionError(f"{place}: {value} is negative")
    return value
