"""What is seen of a model, wherever it lives: of a description, or out of a message."""

from collections.abc import Sequence
from dataclasses import dataclass

from bullet_gazebo.physics.description import Joint, ModelDescription, Shape
from bullet_gazebo.physics.pose import Pose, Vector

NO_STOP = (1.0, 0.0)  # the lower one above the upper one


@dataclass(frozen=True)
class SeenLink:
    """A link's shapes, in its frame; collisions where they are to be seen."""

    name: str
    visuals: Sequence[Shape]
    collisions: Sequence[Shape] = ()


@dataclass(frozen=True)
class SeenJoint:
    """A movable joint. `frame` is its own, in the child link; `axis` is given in it. Stops in [rad, m]."""

    name: str
    kind: str
    child: str
    frame: Pose
    axis: Vector
    lower: float
    upper: float


@dataclass(frozen=True)
class SeenModel:
    """A model. `number` is of this very one: another one of its name has another number.

    `root` is the index of the link that it stands on, `frame` the model's own, seen from that link.
    """

    number: int
    name: str
    links: Sequence[SeenLink] = ()
    joints: Sequence[SeenJoint] = ()
    root: int = 0
    frame: Pose = Pose()


def seen_model(
    description: ModelDescription,
    number: int,
    name: str,
    links: Sequence[str],
    joints: Sequence[str],
    collisions: bool,
) -> SeenModel:
    """Returns what is seen of these links and joints, the `collisions` where they are asked for."""
    return SeenModel(
        number,
        name,
        [_link(description, each, collisions) for each in links],
        [_joint(description.joints[each]) for each in joints],
        links.index(description.root) if description.root in links else 0,
        description.root_pose.inverse(),
    )


def _link(description: ModelDescription, name: str, collisions: bool) -> SeenLink:
    link = description.links[name]
    # A plane is read as a collision only, and the ground is to be seen.
    planes = [shape for shape in link.collisions if shape.kind == "plane"]
    others = [shape for shape in link.collisions if shape.kind != "plane"]
    return SeenLink(name, [*link.visuals, *planes], others if collisions else [])


def _joint(joint: Joint) -> SeenJoint:
    lower, upper = (joint.lower, joint.upper) if joint.bounded else NO_STOP
    return SeenJoint(joint.name, joint.kind, joint.child, joint.anchor, joint.axis, lower, upper)
