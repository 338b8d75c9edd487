"""Elements of links and joints that say how they move: kinematic links, decay of velocity, springs."""

from xml.etree.ElementTree import Element

from robot_sim.physics.description import Joint, Link, ModelDescription
from robot_sim.physics.files.elements import finite, given, shown, truth
from robot_sim.physics.files.sdf_parts import value

SPRING = {"springStiffness": "spring_stiffness", "springReference": "spring_reference"}


def read_link_motion(link: Link, element: Element, warnings: list[str]) -> None:
    """Reads whether a link is kinematic, and the shares of its velocity that are lost in a step.

    A share that is not between 0 and 1 is a warning. Of several elements Gazebo takes the first.

    Args:
        link: What is changed.
        element: The `<link>` of an SDF file, or URDF's `<gazebo reference=…>`, which may have a
            `<dampingFactor>` for both velocities.
        warnings: Receives a line for what is left out.
    """
    where = f"link '{link.name}', velocity_decay"
    link.kinematic = link.kinematic or truth(element.findtext("kinematic"))
    decay, factor = element.find("velocity_decay"), element.find("dampingFactor")
    if decay is not None:
        shares = value(decay, "linear", where, 0.0), value(decay, "angular", where, 0.0)
    elif factor is not None:
        shares = (finite(given(factor), where),) * 2
    else:
        return
    if not 0.0 <= min(shares) <= max(shares) <= 1.0:
        warnings.append(f"{where}: {shares} are not between 0 and 1; they are left out")
    elif link.decay is None:
        link.decay = shares


def settle_kinematic(model: ModelDescription) -> None:
    """Makes the root link alone kinematic, if a link is that no joint moves; the others are a warning."""
    for link in model.links.values():
        if not link.kinematic:
            continue
        link.kinematic = False
        moving = [joint.name for joint in model.carriers(link.name) if joint.movable]
        if moving and not model.static:
            model.warnings.append(
                f"link '{link.name}', kinematic: left out, since joint '{moving[-1]}' moves it"
            )
        else:
            model.links[model.root].kinematic = not model.fixed_base


def read_spring(joint: Joint, block: Element) -> None:
    """Reads the spring of URDF's `<gazebo reference=…>` of a joint."""
    for element in block:
        if element.tag in SPRING:
            place = f"<gazebo reference='{shown(joint.name)}'>, <{element.tag}>"
            setattr(joint, SPRING[element.tag], finite(given(element), place))
