"""The visible parts of models: their shapes as records for a page, and as triangles for a renderer."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from robot_sim.physics.description import Color, DescriptionError, Joint, Link, ModelDescription, Shape
from robot_sim.physics.dynamics import link_poses
from robot_sim.physics.files.meshes import read_look
from robot_sim.physics.pose import Pose, rotate

GREY: Color = (0.7, 0.7, 0.72, 1.0)  # of a shape without a colour
SIDES = 40  # of a cylinder
MOST_RINGS = 16  # of a prism
ROUNDS = 3  # of dividing a ball's triangles


@dataclass(frozen=True)
class VisibleModel:
    """A model's links with their shapes, and its movable joints.

    `number` is unique: another model with its name has another number. `root` is the index of its root link,
    `frame` the model's frame as seen from that link. A `static` one never moves. A joint's `parent` is the
    child of the movable one above, or empty: then its `pose` is in the model.
    """

    number: int
    name: str
    links: Sequence[Link] = ()
    joints: Sequence[Joint] = ()
    root: int = 0
    frame: Pose = Pose()
    static: bool = False
    tips: Mapping[str, Pose] = field(default_factory=dict)  # by joint: the farthest frame in its child

    def corners(self, links: np.ndarray) -> np.ndarray:
        """Returns box corners around its visuals (n, 3) [m], from the poses (m, 7) of its links."""
        poses = {each.name: pose_of(row) for each, row in zip(self.links, links, strict=True)}
        shapes = [(each.name, shape) for each in self.links for shape in each.visuals]
        bounded = boxes_of((link, shape) for link, shape in shapes if shape.kind != "plane")
        found = [moved(box, poses[link].compose(pose)) for link, pose, box in bounded]
        return np.concatenate([np.zeros((0, 3)), *found])

    def pose(self, links: np.ndarray) -> Pose:
        """Returns where the model's frame is, from the poses (n, 7) of its links."""
        return pose_of(links[self.root]).compose(self.frame)


def pose_of(row: np.ndarray) -> Pose:
    """Returns a pose of seven numbers."""
    x, y, z, qx, qy, qz, qw = row.tolist()
    return Pose((x, y, z), (qx, qy, qz, qw))


class Solid(NamedTuple):
    """Triangles [m], corner by corner (3 n, 3), and the normals there."""

    corners: np.ndarray
    normals: np.ndarray


class Piece(NamedTuple):
    """Triangles of one colour or texture; `texture` and `uvs` (3 n, 2) as in `MeshPart`."""

    solid: Solid
    rgba: Color
    texture: np.ndarray | None = None
    uvs: np.ndarray | None = None


def visible_model(
    description: ModelDescription,
    number: int,
    name: str,
    links: Sequence[str],
    joints: Sequence[str],
    collisions: bool,
) -> VisibleModel:
    """Returns the visible parts of these links and joints, with collision shapes if `collisions`."""
    chained, tips = _chained(description, joints)
    return VisibleModel(
        number, name, [_link(description, each, collisions) for each in links], chained,
        links.index(description.root) if description.root in links else 0,
        description.root_pose.inverse(), description.static, tips,
    )  # fmt: skip


def _chained(model: ModelDescription, names: Sequence[str]) -> tuple[list[Joint], dict[str, Pose]]:
    zero = link_poses(model, model.root_pose, {})
    movers = {link: ["", *(each.child for each in model.carriers(link) if each.movable)] for link in zero}
    frames = [*((link, Pose()) for link in zero), *model.lumped.values()]
    joints, tips = [], {}
    for joint in [model.joints[name] for name in names]:
        parent, child, hinge = movers[joint.child][-2], zero[joint.child], joint.anchor.position
        joints.append(replace(joint, parent=parent, pose=child.relative_to(zero.get(parent, Pose()))))
        moved = [zero[link].compose(at) for link, at in frames if movers[link][-1] == joint.child]
        ends = [each.relative_to(child) for each in moved]
        _, tips[joint.name] = max((math.dist(each.position, hinge), each) for each in ends)
    return joints, tips


def _link(description: ModelDescription, name: str, collisions: bool) -> Link:
    link = description.links[name]
    # A plane is read as a collision only, and the ground has to be visible.
    planes = [shape for shape in link.collisions if shape.kind == "plane"]
    others = [shape for shape in link.collisions if shape.kind != "plane" and collisions]
    return Link(name, collisions=others, visuals=[*link.visuals, *planes])


def visible_shapes(model: ModelDescription) -> list[tuple[str, Shape]]:
    """Returns a model's visible shapes with their links, or its collision shapes if it has no visuals."""
    visuals = [(link.name, shape) for link in model.links.values() for shape in link.visuals]
    found = visuals or [(link.name, shape) for link in model.links.values() for shape in link.collisions]
    seen = [(link, shape) for link, shape in found if shape.rgba is None or shape.rgba[3] > 0.0]
    # The renderer draws the ground.
    return [(link, shape) for link, shape in seen if shape.kind != "plane"]


def solid_of(shape: Shape) -> Solid:
    """Returns the triangles of a shape, in its own frame."""
    if shape.kind == "mesh":
        mesh = shape.solid or read_look(shape.mesh).mesh
        return _flat(_scaled(mesh.vertices[mesh.faces], shape.size))
    if shape.kind == "box":
        return _flat(_box(shape.size))
    if shape.kind == "cylinder":
        radius, length = shape.size
        angles = np.linspace(0.0, 2.0 * math.pi, SIDES, endpoint=False)
        return _flat(_prism(radius * np.stack([np.cos(angles), np.sin(angles)], axis=1), length))
    # Imported with the first ball: trimesh takes long.
    from trimesh import creation

    ball = creation.icosphere(subdivisions=ROUNDS, radius=shape.size[0])
    corners = ball.vertices[ball.faces].reshape(-1, 3)
    return Solid(corners, corners / shape.size[0])


def pieces_of(shape: Shape) -> list[Piece]:
    """Returns the triangles of a shape by colour and texture, in its own frame; a mesh file's own come first.

    Raises DescriptionError if a mesh file can't be read.
    """
    rgba = shape.rgba or GREY
    if shape.kind != "mesh" or shape.solid is not None:
        return [Piece(solid_of(shape), rgba)]
    order = slice(None, None, _turn(shape.size))
    pieces = [
        Piece(
            _flat(_scaled(part.triangles, shape.size)), part.rgba or rgba, part.texture,
            None if part.uvs is None else part.uvs[:, order].reshape(-1, 2),
        )
        for part in read_look(shape.mesh).parts
    ]  # fmt: skip
    return pieces or [Piece(solid_of(shape), rgba)]


def _scaled(triangles: np.ndarray, size: tuple[float, ...]) -> np.ndarray:
    """Scales triangles (n, 3, 3) of a mesh; a scale that mirrors them keeps the same side outwards."""
    return np.asarray((triangles * np.array(size))[:, :: _turn(size)])


def _turn(size: tuple[float, ...]) -> int:
    return 1 if math.prod(size) > 0.0 else -1


def box_around(solid: Solid) -> np.ndarray:
    """Returns the corners of the box around a solid, in its frame [m]: (8, 3)."""
    low, high = solid.corners.min(axis=0), solid.corners.max(axis=0)
    return np.array([[(low, high)[i >> k & 1][k] for k in range(3)] for i in range(8)])


def boxes_of(shapes: Iterable[tuple[str, Shape]]) -> Iterator[tuple[str, Pose, np.ndarray]]:
    """Yields link, pose in it, and box corners (8, 3) around each shape that can be drawn."""
    for link, shape in shapes:
        try:
            yield link, shape.pose, box_around(solid_of(shape))
        except DescriptionError:
            continue  # drawing it reports that


def moved(points: np.ndarray, pose: Pose) -> np.ndarray:
    """Transforms points (n, 3) from a frame into the one that its `pose` is given in."""
    axes = [rotate(pose.orientation, axis) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))]
    return np.asarray(points @ np.array(axes) + pose.position)


def _box(size: tuple[float, ...]) -> np.ndarray:
    """Returns the triangles (n, 3, 3) of a box, a prism along its longest side."""
    longest = int(np.argmax(size))
    order = [(longest + 1) % 3, (longest + 2) % 3, longest]
    x, y, length = (size[axis] for axis in order)
    profile = np.array([(x, y), (-x, y), (-x, -y), (x, -y)]) / 2.0
    return _prism(profile, length)[..., np.argsort(order)]


def _prism(profile: np.ndarray, length: float) -> np.ndarray:
    """Returns the triangles (n, 3, 3) of a prism along z with a counter-clockwise profile (k, 2).

    A long one is made of short pieces: the renderer's time grows with the box around each triangle.
    """
    width = float(np.ptp(profile, axis=0).max())
    rings = min(MOST_RINGS, max(1, math.ceil(length / width))) if width > 0.0 else 1
    heights = np.linspace(-length / 2.0, length / 2.0, rings + 1)
    rims = np.array([np.column_stack([profile, np.full(len(profile), z)]) for z in heights])
    low, high = rims[:-1], rims[1:]
    low_next, high_next = np.roll(low, -1, axis=1), np.roll(high, -1, axis=1)
    sides = [(low, low_next, high_next), (low, high_next, high)]
    top, bottom = rims[-1], rims[0]
    ends = [
        (np.broadcast_to((0.0, 0.0, heights[-1]), top.shape), top, np.roll(top, -1, axis=0)),
        (np.broadcast_to((0.0, 0.0, heights[0]), top.shape), np.roll(bottom, -1, axis=0), bottom),
    ]
    pieces = [np.stack(corners, axis=-2).reshape(-1, 3, 3) for corners in [*sides, *ends]]
    return np.concatenate(pieces)


def _flat(triangles: np.ndarray) -> Solid:
    """Gives every triangle its own normal, so that edges are visible."""
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = np.repeat(normals / np.where(lengths > 0.0, lengths, 1.0), 3, axis=0)
    return Solid(triangles.reshape(-1, 3), normals)
