"""A whole URDF: its links, joints and extensions, its fixed joints lumped as Gazebo does."""

from xml.etree.ElementTree import Element

from bullet_gazebo.physics import elements
from bullet_gazebo.physics.description import DescriptionError, Joint, ModelDescription
from bullet_gazebo.physics.elements import shown
from bullet_gazebo.physics.files.reading import Reading
from bullet_gazebo.physics.files.urdf.extensions import apply_extensions
from bullet_gazebo.physics.files.urdf.joints import read_joint
from bullet_gazebo.physics.files.urdf.links import LinkReader
from bullet_gazebo.physics.files.urdf.values import read_origin
from bullet_gazebo.physics.mechanics.bounds import check_shapes
from bullet_gazebo.physics.mechanics.lumping import lump_fixed_joints
from bullet_gazebo.physics.mechanics.tree import check_count, find_roots, unique
from bullet_gazebo.physics.meshes.mesh_files import MeshFinder, Resources


def parse_urdf(
    text: str | bytes, source: str = "URDF", resources: Resources | None = None
) -> ModelDescription:
    """Returns the model that `text` describes, its fixed joints lumped as Gazebo does.

    `resources` finds mesh files.

    Raises:
        DescriptionError: if it can't be simulated: `source`, the place and the fault, in one line.
    """
    reading = Reading()
    with elements.place(source):
        return read_urdf(reading.parse(text), resources or Resources(), reading)


def read_urdf(robot: Element, resources: Resources, reading: Reading) -> ModelDescription:
    """As parse_urdf, from the root element."""
    if robot.tag != "robot":
        raise DescriptionError(f"the root element is <{shown(robot.tag)}>, not <robot>")
    warnings: list[str] = []
    reader = LinkReader(MeshFinder(resources, reading.mesh, warnings=warnings), reading, warnings)
    reader.learn_materials(robot)
    found = robot.findall("link")
    check_count(len(found))
    links = unique(map(reader.read, found), "link")
    check_shapes(links.values())

    def read(element: Element) -> Joint:
        reading.check()
        return read_joint(element, warnings)

    joints = unique(map(read, robot.findall("joint")), "joint")
    roots = find_roots(links, joints)
    if len(roots) > 1:
        raise DescriptionError(f"links {roots[:10]} all have no parent joint; one root is needed")
    model = ModelDescription(robot.get("name", ""), links, joints, roots[0], warnings=warnings)
    model.initial_pose = read_origin(robot, "robot")
    apply_extensions(model, robot)
    reading.check()
    try:
        return lump_fixed_joints(model)
    except DescriptionError as error:
        if not warnings:
            raise
        # An inertial that was left out is what a root without mass comes from.
        raise DescriptionError(f"{error}. Before that: {warnings[0]}") from error
