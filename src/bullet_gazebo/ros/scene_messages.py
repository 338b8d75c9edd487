"""Conversions between visible models and lights and the messages of a scene."""

from collections.abc import Iterable

from bullet_gazebo_msgs.msg import SceneJoint, SceneLight, SceneLink, SceneModel, SceneShape
from geometry_msgs.msg import Vector3
from std_msgs.msg import ColorRGBA

from bullet_gazebo.physics.description import Color, Light, Shape
from bullet_gazebo.physics.model import Model
from bullet_gazebo.pictures.visuals import VisibleJoint, VisibleLink, VisibleModel, visible_model
from bullet_gazebo.ros.common.messages import from_pose_msg, to_pose_msg, to_vector


def to_model(model: Model, number: int, collisions: bool) -> SceneModel:
    """Converts the visible parts of a model, with its collision shapes if `collisions`."""
    description = model.description
    seen = visible_model(
        description, number, model.name, model.link_names, model.joint_names, collisions
    )
    return SceneModel(
        number=number,
        name=model.name,
        is_static=description.static,
        links=[
            SceneLink(link.name, _to_shapes(link.visuals), _to_shapes(link.collisions))
            for link in seen.links
        ],
        joints=[_to_joint(joint) for joint in seen.joints],
        root=seen.root,
        frame=to_pose_msg(seen.frame),
    )


def from_model(message: SceneModel) -> VisibleModel:
    return VisibleModel(
        message.number,
        message.name,
        [
            VisibleLink(link.name, _from_shapes(link.visuals), _from_shapes(link.collisions))
            for link in message.links
        ],
        [_from_joint(joint) for joint in message.joints],
        message.root,
        from_pose_msg(message.frame),
    )


def to_light(light: Light) -> SceneLight:
    return SceneLight(
        name=light.name,
        kind=light.kind,
        diffuse=ColorRGBA(*light.diffuse),
        pose=to_pose_msg(light.pose),
        direction=Vector3(*light.direction),
    )


def from_light(message: SceneLight) -> Light:
    return Light(
        message.name,
        diffuse=_from_color(message.diffuse),
        direction=to_vector(message.direction),
        pose=from_pose_msg(message.pose),
        kind=message.kind,
    )


def _to_joint(joint: VisibleJoint) -> SceneJoint:
    return SceneJoint(
        name=joint.name,
        kind=joint.kind,
        child=joint.child,
        frame=to_pose_msg(joint.frame),
        axis=Vector3(*joint.axis),
        lower=joint.lower,
        upper=joint.upper,
    )


def _from_joint(message: SceneJoint) -> VisibleJoint:
    return VisibleJoint(
        message.name,
        message.kind,
        message.child,
        from_pose_msg(message.frame),
        to_vector(message.axis),
        message.lower,
        message.upper,
    )


def _to_shapes(shapes: Iterable[Shape]) -> list[SceneShape]:
    return [
        SceneShape(
            name=shape.name,
            kind=shape.kind,
            size=shape.size,
            pose=to_pose_msg(shape.pose),
            mesh=shape.mesh,
            has_color=shape.rgba is not None,
            color=ColorRGBA(*(shape.rgba or (0.0, 0.0, 0.0, 0.0))),
        )
        for shape in shapes
    ]


def _from_shapes(messages: Iterable[SceneShape]) -> list[Shape]:
    return [
        Shape(
            message.kind,
            tuple(message.size),
            from_pose_msg(message.pose),
            message.mesh,
            _from_color(message.color) if message.has_color else None,
            message.name,
        )
        for message in messages
    ]


def _from_color(message: ColorRGBA) -> Color:
    return (message.r, message.g, message.b, message.a)
