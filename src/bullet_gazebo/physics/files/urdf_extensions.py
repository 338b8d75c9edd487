"""What `<gazebo>` blocks of a URDF say beyond URDF: plugins, friction, gravity, kept fixed joints.

See docs/contract/gazebo.md 2.4. Sensors are out of scope: they are listed in `left_out`.
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
from bullet_gazebo.physics.elements import finite, truth


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
                f"<gazebo reference='{reference[:80]}'> refers to no link or joint"
            )


def read_plugin(element: Element) -> Plugin:
    return Plugin(element.get("filename", ""), element.get("name", ""), element)


def name_sensor(element: Element, owner: str) -> str:
    """Returns what to call a sensor that is left out."""
    kind, name = element.get("type", "unknown"), element.get("name", "")
    return f"{kind} sensor '{name}' of {owner}"


def _apply_to_model(model: ModelDescription, block: Element) -> None:
    model.plugins += [read_plugin(element) for element in block.findall("plugin")]
    for element in block:
        if element.tag == "static":
            model.static = model.static or truth(element.text)
        elif element.tag == "self_collide" and truth(element.text):
            for link in model.links.values():
                link.self_collide = True


def _apply_to_link(model: ModelDescription, link: Link, block: Element) -> None:
    for element in block:
        place = f"<gazebo reference='{link.name}'>, <{element.tag}>"
        if element.tag == "mu1":
            mu = _not_negative(element.text or "", place)
            link.collisions = [replace(shape, mu=mu) for shape in link.collisions]
        elif element.tag == "turnGravityOff":
            link.gravity = not truth(element.text)
        elif element.tag == "gravity":
            link.gravity = truth(element.text, default=True)
        elif element.tag == "selfCollide":
            link.self_collide = truth(element.text)
        elif element.tag == "sensor":
            model.left_out.append(name_sensor(element, f"link '{link.name}'"))
        elif element.tag == "plugin":
            model.left_out.append(f"plugin {element.get('filename', '')} of link '{link.name}'")


def _apply_to_joint(joint: Joint, block: Element) -> None:
    """A fixed joint is kept as it is, or as a hinge that can't turn."""
    if joint.kind != "fixed":
        return
    if truth(block.findtext("preserveFixedJoint")):
        joint.kept = True
    elif truth(block.findtext("disableFixedJointLumping")):
        joint.kind = "revolute"


def _not_negative(text: str, place: str) -> float:
    value = finite(text, place)
    if value < 0.0:
        raise DescriptionError(f"{place}: {value} is negative")
    return value
