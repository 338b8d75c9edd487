"""SDF joints in a URDF's `<gazebo>`: they close loops, or fix the robot to the world.

sdformat copies them into the model that it makes of the URDF, once fixed joints are lumped.
"""

from collections.abc import Iterable
from dataclasses import replace
from xml.etree.ElementTree import Element

from robot_sim.physics.description import DescriptionError, Joint, Link, ModelDescription
from robot_sim.physics.dynamics import link_poses
from robot_sim.physics.files.elements import named
from robot_sim.physics.files.sdf_parts import Frames, JointReader, joint_end, read_pose
from robot_sim.physics.loops import span
from robot_sim.physics.lumping import WORLD, detach_from_world
from robot_sim.physics.pose import Pose

URDFS_VERSION = (1, 7)  # of the SDF that sdformat makes of a URDF


def add_extension_joints(model: ModelDescription, robot: Element) -> None:
    """Adds the joints of `robot` to `model`, whose fixed joints are lumped; a faulty one is a warning."""
    blocks = (block for block in robot.findall("gazebo") if not block.get("reference"))
    found = [element for block in blocks for element in block.findall("joint")]
    if not found or model.static:
        return
    poses = link_poses(model, model.root_pose, {})
    poses |= {name: poses[link].compose(pose) for name, (link, pose) in model.lumped.items()}
    joints, links = dict(model.joints), dict(model.links)
    for given in _read(found, poses, model.warnings):
        joint = _on_whole_links(given, model)
        if joint.name in joints:
            model.warnings.append(
                f"joint '{joint.name}' is there twice; that in <gazebo> is left out"
            )
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
