"""Shapes as triangles, for whoever draws them."""

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from bullet_gazebo.physics.description import Color, ModelDescription, Shape
from bullet_gazebo.physics.pose import Pose, rotate
from bullet_gazebo.pictures.looks import read_look

if TYPE_CHECKING:  # a simulator only asks what is visible
    from PIL import Image

GREY: Color = (0.7, 0.7, 0.72, 1.0)  # of a shape that has no colour
SIDES = 40  # of a cylinder
MOST_RINGS = 16  # of a prism
ROUNDS = 3  # of dividing a ball's triangles


class Solid(NamedTuple):
    """Triangles [m], corner by corner: (3 n, 3), and the normals there."""

    corners: np.ndarray
    normals: np.ndarray


class Piece(NamedTuple):
    """Triangles of one look. `uvs` (3 n, 2) are their corners' places in the texture, see `looks.Part`."""

    solid: Solid
    rgba: Color
    texture: "Image.Image | None" = None
    uvs: np.ndarray | None = None


def visible_shapes(model: ModelDescription) -> list[tuple[str, Shape]]:
    """What is seen of a model, each with its link; of one that has no visuals, its collisions."""
    visuals = [(link.name, shape) for link in model.links.values() for shape in link.visuals]
    found = visuals or [
        (link.name, shape) for link in model.links.values() for shape in link.collisions
    ]
    seen = [(link, shape) for link, shape in found if shape.rgba is None or shape.rgba[3] > 0.0]
    return [(link, shape) for link, shape in seen if shape.kind != "plane"]  # the ground is drawn


def solid_of(shape: Shape) -> Solid:
    """The triangles of a shape, in its own frame.

    Raises:
        DescriptionError: for a mesh file that can't be read.
    """
    if shape.kind == "mesh":
        mesh = shape.solid or read_look(shape.mesh)
        return _flat(_scaled(mesh.vertices[mesh.faces], shape.size))
    if shape.kind == "box":
        return _flat(_box(shape.size))
    if shape.kind == "cylinder":
        radius, length = shape.size
        angles = np.linspace(0.0, 2.0 * math.pi, SIDES, endpoint=False)
        return _flat(_prism(radius * np.stack([np.cos(angles), np.sin(angles)], axis=1), length))
    # Imported with the first ball: who looks at none doesn't pay for it.
    from trimesh import creation

    ball = creation.icosphere(subdivisions=ROUNDS, radius=shape.size[0])
    corners = ball.vertices[ball.faces].reshape(-1, 3)
    return Solid(corners, corners / shape.size[0])


def pieces_of(shape: Shape) -> list[Piece]:
    """The triangles of a shape as they look, in its own frame; a mesh file's own looks come first.

    Raises:
        DescriptionError: for a mesh file that can't be read.
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
    """Triangles (n, 3, 3) of a mesh in its scale, with the same side outwards where that mirrors them."""
    return np.asarray((triangles * np.array(size))[:, :: _turn(size)])


def _turn(size: tuple[float, ...]) -> int:
    return 1 if math.prod(size) > 0.0 else -1


def box_around(solid: Solid) -> np.ndarray:
    """Corners of the box around a solid, in its frame [m]: (8, 3)."""
    low, high = solid.corners.min(axis=0), solid.corners.max(axis=0)
    return np.array([[(low, high)[i >> k & 1][k] for k in range(3)] for i in range(8)])


def moved(points: np.ndarray, pose: Pose) -> np.ndarray:
    """Points (n, 3) of a frame, in the one that its pose is given in."""
    axes = [
        rotate(pose.orientation, axis)
        for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    ]
    return np.asarray(points @ np.array(axes) + pose.position)


def _box(size: tuple[float, ...]) -> np.ndarray:
    """Triangles (n, 3, 3) of a box, a prism along its longest side."""
    longest = int(np.argmax(size))
    order = [(longest + 1) % 3, (longest + 2) % 3, longest]
    x, y, length = (size[axis] for axis in order)
    profile = np.array([(x, y), (-x, y), (-x, -y), (x, -y)]) / 2.0
    return _prism(profile, length)[..., np.argsort(order)]


def _prism(profile: np.ndarray, length: float) -> np.ndarray:
    """Triangles (n, 3, 3) of a prism around z, whose profile (k, 2) goes round counter-clockwise.

    A long one is made of short pieces: the renderer's time goes with the box around each triangle.
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
    """Every triangle with its own normal, so that edges are seen."""
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = np.repeat(normals / np.where(lengths > 0.0, lengths, 1.0), 3, axis=0)
    return Solid(triangles.reshape(-1, 3), normals)
