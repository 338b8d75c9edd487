"""Descriptions and lights as the messages of a scene."""

from bullet_gazebo_msgs.msg import SceneJoint, SceneLight, SceneLink, SceneModel, SceneShape
from geometry_msgs.msg import Vector3
from std_msgs.msg import ColorRGBA

from bullet_gazebo.physics.description import Light, Shape
from bullet_gazebo.physics.model import Model
from bullet_gazebo.ros.wire.conversions import to_pose_msg


def to_model(model: Model, number: int, collisions: bool) -> SceneModel:
    """Returns all that the model consists of, its `collisions` where they are asked for."""
    description = model.description
    names = model.link_names
    links = []
    for name in names:
        link = description.links[name]
        # A plane is read as a collision only, and the ground is to be seen.
        planes = [shape for shape in link.collisions if shape.kind == "plane"]
        others = [shape for shape in link.collisions if shape.kind != "plane"]
        links.append(
            SceneLink(
                name,
                [_to_shape(shape) for shape in (*link.visuals, *planes)],
                [_to_shape(shape) for shape in others if collisions],
            )
        )
    joints = [
        SceneJoint(
            name=joint.name,
            kind=joint.kind,
            child=joint.child,
            frame=to_pose_msg(joint.anchor),
            axis=Vector3(*joint.axis),
            lower=joint.lower if joint.bounded else 1.0,
            upper=joint.upper if joint.bounded else 0.0,
        )
        for joint in (description.joints[name] for name in model.joint_names)
    ]
    return SceneModel(
        number=number,
        name=model.name,
        is_static=description.static,
        links=links,
        joints=joints,
        root=names.index(description.root) if description.root in names else 0,
        frame=to_pose_msg(description.root_pose.inverse()),
    )


def to_light(light: Light) -> SceneLight:
    return SceneLight(
        name=light.name,
        kind=light.kind,
        diffuse=ColorRGBA(*light.diffuse),
        pose=to_pose_msg(light.pose),
        direction=Vector3(*light.direction),
    )


def _to_shape(shape: Shape) -> SceneShape:
    return SceneShape(
        name=shape.name,
        kind=shape.kind,
        size=shape.size,
        pose=to_pose_msg(shape.pose),
        mesh=shape.mesh,
        has_color=shape.rgba is not None,
        color=ColorRGBA(*(shape.rgba or (0.0, 0.0, 0.0, 0.0))),
    )
