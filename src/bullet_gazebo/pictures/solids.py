"""Shapes as triangles, for whoever draws them."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from bullet_gazebo.physics.description import Color, ModelDescription, Shape
from bullet_gazebo.physics.meshes.reader import read_mesh

GREY: Color = (0.7, 0.7, 0.72, 1.0)  # of a shape that has no colour
SIDES = 48  # of a cylinder
ROUNDS = 3  # of dividing a ball's triangles


class Solid(NamedTuple):
    """Triangles [m], corner by corner: (3 n, 3), and the normals there."""

    corners: np.ndarray
    normals: np.ndarray


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
        mesh = shape.solid or read_mesh(Path(shape.mesh))
        return _flat((mesh.vertices * np.array(shape.size))[mesh.faces])
    # Imported with the first shape: who looks at nothing doesn't pay for it.
    from trimesh import creation

    if shape.kind == "box":
        box = creation.box(extents=shape.size)
        return _flat(box.vertices[box.faces])
    if shape.kind == "cylinder":
        radius, length = shape.size
        drum = creation.cylinder(radius=radius, height=length, sections=SIDES)
        return _flat(drum.vertices[drum.faces])
    ball = creation.icosphere(subdivisions=ROUNDS, radius=shape.size[0])
    corners = ball.vertices[ball.faces].reshape(-1, 3)
    return Solid(corners, corners / shape.size[0])


def _flat(triangles: np.ndarray) -> Solid:
    """Every triangle with its own normal, so that edges are seen."""
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = np.repeat(normals / np.where(lengths > 0.0, lengths, 1.0), 3, axis=0)
    return Solid(triangles.reshape(-1, 3), normals)
