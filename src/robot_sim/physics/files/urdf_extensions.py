"""A URDF's `<gazebo>` extensions of links, joints and the model, SDF joints included.

sdformat copies those into the model that it makes of the URDF, once fixed joints are lumped. They close
loops, or fix the robot to the world.
"""

from collections.abc import Iterable
from dataclasses import replace
from typing import Any
from xml.etree.ElementTree import Element

from robot_sim.physics.description import DescriptionError, Joint, Link, ModelDescription
from robot_sim.physics.dynamics import link_poses
from robot_sim.physics.files.elements import finite, given, named, read_plugin, shown
from robot_sim.physics.files.motion import read_link_motion, read_spring
from robot_sim.physics.files.sdf_parts import (
    Frames,
    JointReader,
    joint_end,
    material_color,
    read_pose,
    read_sensors,
)
from robot_sim.physics.loops import span
from robot_sim.physics.lumping import WORLD, detach_from_world
from robot_sim.physics.pose import Pose

YES = ("true", "yes", "1")
NO = ("false", "no", "0")
SURFACE = {"mu1": "mu", "maxVel": "max_vel", "laserRetro": "retro"}  # of shapes, by element
URDFS_VERSION = (1, 7)  # of the SDF that sdformat makes of a URDF


def apply_extensions(model: ModelDescription, robot: Element) -> None:
    """Applies the `<gazebo>` children of `robot` to `model`, before its joints are lumped.

    They have plugins, friction, gravity, kept fixed joints (docs/contract/gazebo.md 2.4). A value is the
    attribute `value`, or else the text. A reference to an unknown link or joint is a warning, as in Gazebo.
    """
    for block in robot.findall("gazebo"):
        reference = block.get("reference")
        if not reference:
            _apply_to_model(model, block)
        elif reference in model.links:
            _apply_to_link(model, model.links[reference], block)
        elif reference in model.joints:
            _apply_to_joint(model, model.joints[reference], block)
        else:
            model.warnings.append(f"<gazebo reference='{shown(reference)}'> refers to no link or joint")


def _apply_to_model(model: ModelDescription, block: Element) -> None:
    model.plugins += [read_plugin(element) for element in block.findall("plugin")]
    for element in block:
        if element.tag == "static":
            model.static = model.static or _value(element) in YES
        elif element.tag == "self_collide" and _value(element) in YES:
            for link in model.links.values():
                link.self_collide = True


def _apply_to_link(model: ModelDescription, link: Link, block: Element) -> None:
    model.sensors += read_sensors(block, link.name, model.warnings)
    read_link_motion(link, block, model.warnings)
    for element in block:
        place = f"<gazebo reference='{shown(link.name)}'>, <{element.tag}>"
        if element.tag in SURFACE:
            number = finite(_value(element), place)
            if number < 0.0 and element.tag != "laserRetro":
                raise DescriptionError(f"{place}: {number} is negative")
            changed: dict[str, Any] = {SURFACE[element.tag]: number}
            link.collisions = [replace(shape, **changed) for shape in link.collisions]
        elif element.tag in ("turnGravityOff", "gravity"):
            # Anything else than "no" turns it off, also an empty element.
            on = NO if element.tag == "turnGravityOff" else ("", *YES)
            link.gravity, link.says_gravity = _value(element) in on, True
        elif element.tag == "material":
            color = material_color(given(element), model.warnings)
            link.visuals = [replace(shape, rgba=color or shape.rgba) for shape in link.visuals]
        elif element.tag == "selfCollide":
            link.self_collide = _value(element) in YES
        elif element.tag == "plugin":
            name = shown(element.get("filename", ""))
            model.left_out.append(f"plugin {name} of link '{shown(link.name)}'")


def _apply_to_joint(model: ModelDescription, joint: Joint, block: Element) -> None:
    """Reads a joint's sensors and spring; keeps a fixed joint as it is, or as a hinge that can't turn."""
    model.sensors += read_sensors(block, joint.child, model.warnings, joint=joint.name)
    read_spring(joint, block)
    if joint.kind != "fixed":
        return
    if _value(block.find("preserveFixedJoint")) in YES:
        joint.kept = True
    elif _value(block.find("disableFixedJointLumping")) in YES:
        joint.kind, joint.axis = "revolute", (0.0, 0.0, 1.0)
        joint.effort = joint.velocity = -1.0


def _value(element: Element | None) -> str:
    return given(element).lower()


def add_extension_joints(model: ModelDescription, robot: Element) -> None:
    """Adds the joints of `robot` to `model`, whose fixed joints are lumped; a faulty one is a warning."""
    blocks = (block for block in robot.findall("gazebo") if not block.get("reference"))
    elements = [element for block in blocks for element in block.findall("joint")]
    if not elements or model.static:
        return
    poses = link_poses(model, model.root_pose, {})
    poses |= {name: poses[link].compose(pose) for name, (link, pose) in model.lumped.items()}
    joints, links = dict(model.joints), dict(model.links)
    for read in _read(elements, poses, model.warnings):
        joint = _on_whole_links(read, model)
        if joint.name in joints:
            model.warnings.append(f"joint '{joint.name}' is there twice; that in <gazebo> is left out")
            continue
        joints[joint.name] = joint
        if WORLD not in links and joint.parent == WORLD:
            links = {WORLD: Link(WORLD), **links}
    roots = span(links, joints, model.warnings)
    model.links, model.joints = links, joints
    if roots[0] != model.root:
        model.root, model.root_pose = roots[0], poses.get(roots[0], Pose())
        detach_from_world(model)


def _read(found: Iterable[Element], poses: dict[str, Pose], warnings: list[str]) -> Iterable[Joint]:
    frames = Frames()
    for name, pose in poses.items():
        frames.add(name, pose, "")
    reader = JointReader(frames, URDFS_VERSION, warnings)
    for element in found:
        try:
            name = named(element, "joint")
            pose, relative_to = read_pose(element, f"joint '{name}'")
            frames.add(name, pose, relative_to or joint_end(element, "child"))
            yield reader.read(element)
        except DescriptionError as error:
            warnings.append(f"{error}; it is left out")


def _on_whole_links(joint: Joint, model: ModelDescription) -> Joint:
    """Returns the joint with the links that are simulated in place of its own ones."""
    if joint.parent == WORLD and model.world_joints and WORLD not in model.links:
        joint = replace(joint, parent=model.root, pose=joint.pose.relative_to(model.root_pose))
    if joint.parent in model.lumped:
        parent, pose = model.lumped[joint.parent]
        joint = replace(joint, parent=parent, pose=pose.compose(joint.pose))
    if joint.child in model.lumped:
        child, pose = model.lumped[joint.child]
        place, anchor = joint.pose.compose(pose.inverse()), pose.compose(joint.anchor)
        joint = replace(joint, child=child, pose=place, anchor=anchor)
    return joint
